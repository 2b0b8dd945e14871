// `shakerctl diagnose`: the daemon does it, or a separate program, shakerctl-diagnosis.
#include "cli/commands/hand_over.hpp"

namespace shaker::cli {

int diagnose(const Common& common, const DiagnoseCommandOptions& options) {
  if (options.daemon) return diagnose_by_daemon(common, options);
  return hand_over(common, "shakerctl-diagnosis");
}

}  // namespace shaker::cli
