// What an operator is told of a record that does not repeat as assumed
// (estimator/signal/repetition.hpp), with the remedy.
#pragma once

#include <string>

#include "base/result.hpp"
#include "estimator/signal/repetition.hpp"

namespace shaker::cli {

using estimator::Cycles;

inline constexpr int kMostPeriods = 3;  // that can be fitted; a longer period is only reported

// Returns an Error when the cycles do not repeat after `periods` periods, when they are too few
// to decide it, or when they repeat after every period. The Error names the true period if it
// can be determined. `place`: for the message; `run`: the run's name in a database.
Result<void> check_repetition(const Cycles& cycles, int periods, const std::string& place,
                              const std::string& run = {});

// The doubt about a mean cycle: whether the cycles that it averages repeat from one to the
// next.
struct RepetitionDoubt {
  std::string sentence;  // with the remedy; empty: no doubt
  bool spoils = false;   // the deviation is so large that the mean cycle is meaningless
};
RepetitionDoubt doubt_of_repetition(const Cycles& cycles, const std::string& place,
                                    const std::string& run = {});

}  // namespace shaker::cli
