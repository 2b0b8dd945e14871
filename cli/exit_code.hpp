// The exit status of shakerctl. docs/cli.md lists the values; scripts depend on the numbers.
#pragma once

namespace shaker::cli {

enum ExitCode : int {
  kOk = 0,
  kNegative = 1,     // done, but with a bad outcome: a run failed or was stopped
  kBadInput = 2,     // wrong usage, or a file with errors
  kUnreachable = 3,  // no daemon, no permission, another protocol, or connection lost
  kRefused = 4,      // the daemon refused the request
  kNotUsable = 5,    // there is an estimate, but it must not be used
  kIntervals = 6     // the estimate stands, but its intervals do not
};

}  // namespace shaker::cli
