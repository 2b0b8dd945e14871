// Trouble with the daemon as an exit status. Only the commands that talk to it use this.
#pragma once

#include "base/result.hpp"
#include "cli/commands.hpp"
#include "cli/documents_in.hpp"
#include "cli/stream_client.hpp"

namespace shaker::cli {

inline int unreachable(const Common& common, const Error& error) {
  return fail(common, kUnreachable, printable(error.what));
}
inline int refused(const Common& common, const Answer& answer) {
  return fail(common, kRefused, "the daemon refuses: " + printable(answer.message));
}

}  // namespace shaker::cli
