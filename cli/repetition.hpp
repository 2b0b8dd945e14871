// After how many periods of the excitation does a record repeat?
//
// A response that repeats only after two or three periods has no mean cycle: averaged over all
// cycles it is a motion that the damper never made. Whether cycles some periods apart are alike is
// told from the record itself, against its own noise. Pure.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::cli {

inline constexpr int kMostPeriods = 3;  // that can be fitted; longer ones are only named

// Whole cycles of a run one after the other, `points` each, none left out in between.
struct Cycles {
  std::vector<double> y;
  std::size_t points = 0;
  std::size_t count() const { return points == 0 ? 0 : y.size() / points; }
};

// Standard deviation of a point about the mean of all cycles that are `periods` apart. Infinite
// where there are no two of them each.
double scatter_after(const Cycles& cycles, int periods);

// Refuses cycles that do not repeat after `periods` periods, too few to see it, or that repeat
// after every one; says what they do instead where that can be told. `run`: its name in a database.
Result<void> check_repetition(const Cycles& cycles, int periods, const std::string& place,
                              const std::string& run = {});

// Of cycles that are averaged as if each repeated the one before, where they do not.
struct RepetitionDoubt {
  std::string sentence;  // with the remedy; empty: none
  bool spoils = false;   // it is so much of the motion that the mean cycle says nothing
};
RepetitionDoubt doubt_of_repetition(const Cycles& cycles, const std::string& place,
                                    const std::string& run = {});

}  // namespace shaker::cli
