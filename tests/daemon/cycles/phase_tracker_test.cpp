#include "daemon/cycles/phase_tracker.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace shaker::daemon {
namespace {

TEST(PhaseTracker, TwoHundredPartsPerMillionAreFoundFromThirtyTwoPeriods) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0.0, 8e-6);  // turns: 1000 samples, 1/600 noise
  const double truth = 1.0 + 200e-6;
  double frequency_square = 0.0, phase_square = 0.0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    PhaseTracker tracker;
    tracker.restart(1.0);
    for (int k = 0; k < 40; ++k) {
      const double t = 100.0 + k / truth;
      tracker.add(from_seconds(t), std::fmod(truth * t + noise(random), 1.0));
    }
    frequency_square += std::pow(tracker.frequency_hz() / truth - 1.0, 2) / kTrials;
    const double end = 100.0 + 39 / truth;
    phase_square +=
        std::pow(std::remainder(tracker.turns_at(from_seconds(end)) - truth * end, 1.0), 2) /
        kTrials;
  }
  EXPECT_LT(std::sqrt(frequency_square), 0.25e-6);
  EXPECT_LT(std::sqrt(phase_square), 4e-6);
}

TEST(PhaseTracker, TimeAndTurnsAreInverses) {
  PhaseTracker tracker;
  tracker.restart(2.5);
  for (int k = 0; k < 5; ++k)
    tracker.add(from_seconds(3.0 + 0.4 * k), 0.25);
  const double turns = tracker.turns_at(from_seconds(4.321));
  EXPECT_NEAR(seconds(tracker.time_of(turns)), 4.321, 2e-9);
}

TEST(PhaseTracker, AJumpRestartsTheLineInsteadOfBendingIt) {
  PhaseTracker tracker;
  tracker.restart(1.0);
  for (int k = 0; k < 20; ++k)
    tracker.add(from_seconds(k), 0.0);
  for (int k = 20; k < 23; ++k)
    tracker.add(from_seconds(k), 0.1);
  EXPECT_EQ(tracker.jumps(), 1);
  EXPECT_NEAR(tracker.frequency_hz(), 1.0, 1e-9);
  EXPECT_NEAR(tracker.turns_at(from_seconds(23.0)), 23.1, 1e-9);  // the count of turns goes on
}

}  // namespace
}  // namespace shaker::daemon
