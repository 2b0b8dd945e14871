// The steady-state gate: accepts cycles once the response repeats, and states the reason if it
// does not.
//
// The gate tests every whole cycle against the last eight cycles:
//  - Does it repeat the one before? `change` is the root mean square difference in units of what
//    noise alone causes (sqrt 2 of a point's standard deviation): about 1 in the steady state. It
//    must be at most `tolerance` four times in a row, because one agreement may be chance.
//  - Does it drift ("creep")? It does if the mean and the first four harmonics have a slope over
//    the eight cycles that their scatter does not explain (F test at 0.1 %), and that moves the
//    cycle by more than tolerance / 10 of the noise. A slow transient passes the first test long
//    before it is over.
//  - Does it repeat only every second, third or fourth period? Such a subharmonic response is not a
//    periodic solution of period one and must not be fitted as one.
//
// With white noise one cycle in a thousand is rejected. A transient that decays by 10 % a cycle
// is accepted once less than 1.5 times a point's noise is left of it (tests check both).
//
// One thread; never allocates after restart(), except for the text of `why`.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimator/signal/cycle_courses.hpp"

namespace shaker::daemon {

struct GateVerdict {
  bool steady = false;
  double change = 0.0;             // from the cycle before, in units of noise; 0 for the first
  std::optional<int> subharmonic;  // number of periods after which it repeats
  // Drift over the window in units of the noise, if the cycle repeats otherwise; 0: no drift.
  double creep = 0.0;
  std::string why;  // the reason, if not steady
};

class SteadyGate {
 public:
  static constexpr std::size_t kWindow = 8;
  static constexpr int kMissingMost = 2;  // one gap at the boundary of two cycles affects both

  void restart(std::size_t points, double tolerance);
  // Takes a whole cycle (m, `points` values) and the standard deviation of its points' noise
  // (m).
  GateVerdict add(std::span<const double> cycle, double point_noise);
  // Reports a cycle that is not whole. If the next whole cycle agrees with the last one before,
  // only the broken cycle is lost. Otherwise, or after more than kMissingMost in a row, the
  // window starts again. (A response of two periods does not pass as steady by this: two equal
  // cycles of it are followed by a different one.)
  void interrupt() { ++missing_; }
  // Clears the window, because the measurement was held.
  void begin_anew() { count_ = 0; }

 private:
  static constexpr std::size_t kCoefficients = 9;  // mean, and two for each of four harmonics
  struct Entry {
    std::vector<double> cycle;
    std::array<double, kCoefficients> white{};  // scaled to the noise of a point
  };
  const Entry& back(std::size_t age) const { return ring_[(newest_ + kWindow - age) % kWindow]; }
  double difference(std::size_t age, std::size_t apart, double noise) const;
  double recent_change(double noise) const;
  std::optional<int> find_subharmonic(double noise) const;
  bool creeps(double noise, double& shift) const;

  estimator::CycleCourses trend_ = estimator::CycleCourses::trend(kWindow);
  std::array<Entry, kWindow> ring_;
  std::size_t newest_ = 0, count_ = 0, points_ = 0;
  int missing_ = 0;  // cycles since the newest one
  double tolerance_ = 3.0;
};

}  // namespace shaker::daemon
