// The command that needs PostgreSQL's library is in a program of its own, so that the others work
// without that library.
#include "cli/commands/hand_over.hpp"

namespace shaker::cli {

int push(const Common& common, const PushOptions&) {
  return hand_over(common, "shakerctl-push");
}

}  // namespace shaker::cli
