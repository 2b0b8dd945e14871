// After how many periods of the excitation a record repeats, and from where on it is steady.
//
// A response that repeats only after two or three periods has no mean cycle: the average over
// all cycles is a motion that the damper never made. Whether cycles are alike is decided from
// the record itself, against its own noise. The functions are pure.
#pragma once

#include "estimator/signal/cycles.hpp"

namespace shaker::estimator {

inline constexpr int kLongestRepetition = 4;  // periods that are searched for

// The standard deviation of a point from the mean of all cycles that are `periods` apart.
// Infinite when a group has fewer than two cycles.
double scatter_after(const Cycles& cycles, int periods);

enum class Repetition {
  repeats,       // after the periods that were asked for, and not after every one
  too_few,       // fewer cycles than twice the periods
  other_period,  // after `best` periods instead
  settles,       // not yet: the first cycles differ more than the last ones
  never,         // after no number of periods up to kLongestRepetition
  every_period   // cycles next to each other are alike
};

struct RepetitionFinding {
  Repetition kind = Repetition::repeats;
  int best = 1;               // periods after which the record repeats best
  double scatter = 0.0;       // of a point, after the periods that were asked for
  double best_scatter = 0.0;  // the same after `best` periods
  double noise = 0.0;         // the white part of the former
};
// Whether cycles repeat after `periods` periods of the excitation, and not before.
RepetitionFinding find_repetition(const Cycles& cycles, int periods);

// Whether the cycles that a mean cycle averages repeat from one to the next.
struct Alternation {
  int periods = 1;          // after which the record repeats; 1: after every one
  double difference = 0.0;  // of neighbouring cycles, in units of the noise
  bool spoils = false;      // it is so large that the mean cycle is meaningless
};
Alternation find_alternation(const Cycles& cycles);

// The last groups of `periods` cycles, without those of the transient (stationarity.hpp).
Cycles steady_groups(Cycles cycles, int periods);

}  // namespace shaker::estimator
