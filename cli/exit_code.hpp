// What shakerctl's exit status says. docs/cli.md lists them; scripts rely on the numbers.
#pragma once

namespace shaker::cli {

enum ExitCode : int {
  kOk = 0,
  kNegative = 1,     // it was done, and the outcome is bad: a run failed or was stopped
  kBadInput = 2,     // usage, or a file that is not good
  kUnreachable = 3,  // no daemon, no permission, another protocol, or it went away
  kRefused = 4,      // the daemon said no, and why
  kNotUsable = 5     // there is an estimate, but it must not be used
};

}  // namespace shaker::cli
