// How soon another frequency is told from the setpoint's, and what must not be taken for one.
#include "daemon/safety/frequency_watch.hpp"

#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include <gtest/gtest.h>

namespace shaker::daemon {
namespace {

constexpr double kOrderedHz = 4.0, kSampleHz = 1000.0, kTableAmplitude = 3.0;
constexpr double kTurnRad = 2.0 * std::numbers::pi;

// A table that changes its frequency, and its samples.
struct Table {
  double hz = kOrderedHz;  // after the change
  double from_s = 1.0;     // of the change
  double noise = 0.0;      // standard deviation of a sample
  double late_s = 0.0;     // of the stamps, after the change
  double gap_s = 0.0;      // without samples, after the change
  double amplitude = kTableAmplitude;
  double rate_hz = kSampleHz;
};

// When the watch says so, s after the change; nothing within four seconds.
std::optional<double> seen_after(const Table& table, FrequencyWatch& watch) {
  const Nanoseconds grid = from_seconds(17.0);
  watch.restart(kOrderedHz, grid);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  double phase = 0.4;
  for (double t = 0.0; t < table.from_s + 4.0; t += 1.0 / table.rate_hz) {
    const bool changed = t >= table.from_s;
    phase += kTurnRad * (changed ? table.hz : kOrderedHz) / table.rate_hz;
    if (changed && t < table.from_s + table.gap_s) continue;
    watch.add(grid + from_seconds(t + (changed ? table.late_s : 0.0)),
              table.amplitude * std::cos(phase) + table.noise * noise(random),
              {.least = 0.02 * kTableAmplitude, .noise = table.noise, .rate_hz = table.rate_hz});
    if (watch.differs()) return t - table.from_s;
  }
  return std::nullopt;
}
std::optional<double> seen_after(const Table& table) {
  FrequencyWatch watch;
  return seen_after(table, watch);
}

TEST(FrequencyWatchTest, TellsAnotherFrequencyWithinThreePeriodsWheneverItComes) {
  for (const double factor : {0.25, 0.5, 0.8, 0.95, 0.97, 1.03, 1.05, 1.1, 1.5, 2.0, 3.0}) {
    for (int eighth = 0; eighth < 8; ++eighth) {
      const auto after = seen_after({.hz = factor * kOrderedHz, .from_s = 1.0 + eighth / 32.0});
      ASSERT_TRUE(after) << factor << " times the frequency, " << eighth << "/8 of a period later";
      EXPECT_LT(*after, 3.0 / kOrderedHz) << factor << ", " << eighth;
    }
  }
}

TEST(FrequencyWatchTest, NamesTheFrequencyWhereItCanBeTold) {
  for (const double factor : {0.95, 1.05, 1.1}) {
    FrequencyWatch watch;
    ASSERT_TRUE(seen_after({.hz = factor * kOrderedHz}, watch));
    EXPECT_NEAR(watch.frequency_hz(), factor * kOrderedHz, 0.01 * kOrderedHz);
  }
  FrequencyWatch watch;
  ASSERT_TRUE(seen_after({.hz = 2.0 * kOrderedHz}, watch));
  EXPECT_EQ(watch.frequency_hz(), 0.0);
}

TEST(FrequencyWatchTest, SaysNothingOfTheSameFrequency) {
  EXPECT_FALSE(seen_after({}));
  EXPECT_FALSE(seen_after({.hz = 1.005 * kOrderedHz}));  // below what is told
  EXPECT_FALSE(seen_after({.noise = 0.2 * kTableAmplitude}));
  EXPECT_FALSE(seen_after({.noise = 0.2 * kTableAmplitude, .rate_hz = 50.0}));
}

TEST(FrequencyWatchTest, SaysNothingOfLateSamplesOrMissingOnes) {
  for (const double share : {0.02, 0.1, 0.3, 0.7}) {
    EXPECT_FALSE(seen_after({.late_s = share / kOrderedHz})) << share;
    EXPECT_FALSE(seen_after({.gap_s = share / kOrderedHz})) << share;
  }
}

TEST(FrequencyWatchTest, SaysNothingOfATableThatHardlyMoves) {
  EXPECT_FALSE(seen_after({.hz = 2.0 * kOrderedHz, .amplitude = 0.01 * kTableAmplitude}));
}

TEST(FrequencyWatchTest, ForgetsWhatItSuspectedBeforeAndKeepsItsGrid) {
  FrequencyWatch watch;
  ASSERT_TRUE(seen_after({.hz = 1.1 * kOrderedHz}, watch));
  EXPECT_TRUE(watch.suspects());
  watch.forget();
  EXPECT_FALSE(watch.differs() || watch.suspects());
}

}  // namespace
}  // namespace shaker::daemon
