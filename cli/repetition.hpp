// Determines after how many periods of the excitation a record repeats.
//
// A response that repeats only after two or three periods has no mean cycle: the average over
// all cycles is a motion that the damper never made. Whether cycles are alike is decided from
// the record itself, against its own noise. The functions are pure.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::cli {

inline constexpr int kMostPeriods = 3;  // that can be fitted; a longer period is only reported

// Consecutive whole cycles of a run, `points` values each.
struct Cycles {
  std::vector<double> y;
  std::size_t points = 0;
  std::size_t count() const { return points == 0 ? 0 : y.size() / points; }
};

// The standard deviation of a point from the mean of all cycles that are `periods` apart.
// Infinite when a group has fewer than two cycles.
double scatter_after(const Cycles& cycles, int periods);

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
