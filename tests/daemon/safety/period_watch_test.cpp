// The figures of a channel in each period, against the motion that made the samples.
#include "daemon/safety/period_watch.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace shaker::daemon {
namespace {

constexpr double kHz = 4.0, kRate = 1000.0, kAmplitude = 3.0, kPhase = 0.7, kMean = 0.15;

double value_at(double t) {
  return kMean + kAmplitude * std::cos(2.0 * std::numbers::pi * kHz * t + kPhase);
}

// The figures of one second, without the samples between `from` and `to`, s.
std::vector<PeriodFigures> figures(double from, double to) {
  PeriodWatch watch;
  watch.restart(kHz, Nanoseconds{0});
  std::vector<PeriodFigures> all;
  for (int i = 1; i <= 1001; ++i) {
    const double t = i / kRate;
    if (t > from && t < to) continue;
    if (const auto one = watch.add(from_seconds(t), value_at(t))) all.push_back(*one);
  }
  return all;
}

TEST(PeriodWatchTest, FindsAmplitudeAndPhaseAlsoWhereAFifthOfThePeriodIsMissing) {
  const std::complex<double> truth = std::polar(kAmplitude, kPhase);
  for (double from = 0.25; from < 0.45; from += 0.01) {
    const auto all = figures(from, from + 0.05);
    ASSERT_EQ(all.size(), 4u);
    for (const PeriodFigures& one : all)
      EXPECT_LT(std::abs(one.fundamental - truth), 1e-6) << from << ", period " << one.index;
  }
}

TEST(PeriodWatchTest, SaysHowLongSamplesWereMissingInEachPeriod) {
  const auto none = figures(0.0, 0.0);
  ASSERT_EQ(none.size(), 4u);
  for (const PeriodFigures& one : none)
    EXPECT_NEAR(one.longest_gap_s, 0.001, 1e-6);
  // Over the boundary at 0.5 s, which shares it between two periods.
  const auto two = figures(0.470, 0.540);
  ASSERT_EQ(two.size(), 4u);
  EXPECT_NEAR(two[0].longest_gap_s, 0.001, 1e-6);
  EXPECT_NEAR(two[1].longest_gap_s, 0.030, 1e-6);
  EXPECT_NEAR(two[2].longest_gap_s, 0.040, 1e-6);
  EXPECT_NEAR(two[3].longest_gap_s, 0.001, 1e-6);
}

TEST(PeriodWatchTest, SaysWhetherAPeriodIsFilledAndWithoutAGap) {
  const auto one = [](double from, double to) { return figures(from, to)[1]; };
  const PeriodFigures none = one(0.0, 0.0), short_gap = one(0.300, 0.320),
                      long_gap = one(0.300, 0.340), half = one(0.270, 0.420);
  EXPECT_TRUE(none.filled(kRate) && none.whole(kRate));
  EXPECT_TRUE(short_gap.filled(kRate) && short_gap.whole(kRate));  // 8 % of the period
  EXPECT_TRUE(long_gap.filled(kRate));                             // 16 %
  EXPECT_FALSE(long_gap.whole(kRate));
  EXPECT_FALSE(half.filled(kRate) || half.whole(kRate));
  // Two samples in a period are no gap for a slow channel.
  EXPECT_TRUE(long_gap.whole(50.0));
}

}  // namespace
}  // namespace shaker::daemon
