#include "estimator/signal/cycles.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/signal/harmonic_curve.hpp"
#include "estimator/signal/time_series.hpp"

namespace shaker::estimator {
namespace {

constexpr double kPerTurn = 2.0 * std::numbers::pi;

TEST(Cycles, TheMeanOfCyclesHasTheirScatter) {
  const std::vector<double> y = {1.0, 2.0, 3.0, 6.0, 9.0};
  const MeanCycle mean = mean_cycle(y, 2);
  EXPECT_THAT(mean.mean, testing::ElementsAre(2.0, 4.0));
  EXPECT_EQ(mean.scatter, 10.0);
  EXPECT_EQ(mean.cycles, 2.0);
}

// Four cycles that lie 1 off their mean at either of two points: a variance of 4/3.
TEST(Cycles, TheErrorOfAMeanIsThatOfItsPoints) {
  const std::vector<double> y = {4.0, 7.0, 6.0, 9.0, 4.0, 9.0, 6.0, 7.0};
  EXPECT_NEAR(mean_cycle(y, 2).standard_error(), std::sqrt(4.0 / 3.0 / 4.0), 1e-15);
  EXPECT_EQ(mean_cycle(y, 8).standard_error(), 0.0);
}

TEST(Cycles, ChannelsScatterTogether) {
  const MeanChannels mean = mean_channels({{1.0, 2.0, 3.0, 6.0}, {0.0, 1.0, 2.0, -1.0}}, 2);
  EXPECT_THAT(mean.mean[1], testing::ElementsAre(1.0, 0.0));
  EXPECT_THAT(mean.scatter, testing::ElementsAre(10.0, -2.0, -2.0, 4.0));
  EXPECT_TRUE(mean_channels({{1.0, 2.0}, {0.0, 1.0}}, 2).scatter.empty());
}

TEST(Cycles, TheErrorOfAMeanExcitationFallsWithTheRootOfTheCycles) {
  const CycleExcitation one{2.0, 3.0, {1.0, -1.0}, 0.2}, other{4.0, 5.0, {3.0, 1.0}, 0.2};
  const CycleExcitation mean = mean_excitation({one, other, one, other});
  EXPECT_EQ(mean.frequency_hz, 3.0);
  EXPECT_EQ(mean.amplitude, 4.0);
  EXPECT_THAT(mean.samples, testing::ElementsAre(2.0, 0.0));
  EXPECT_NEAR(mean.error, 0.1, 1e-15);
}

TEST(Cycles, SamplesOnNoGridAreReadAtEqualSteps) {
  std::vector<double> t, y;
  for (int i = 0; i < 400; ++i) {
    t.push_back(0.1 + i / 61.0);
    y.push_back(std::cos(kPerTurn * 2.0 * t.back()));
  }
  EXPECT_EQ(points_of_equal_steps(t, 2.0), 0U);
  const Cycles cycles = cycles_of(t, y, 2.0);
  ASSERT_EQ(cycles.points, 32U);
  EXPECT_EQ(cycles.count(), 12U);
  for (std::size_t i = 0; i < cycles.y.size(); ++i)
    EXPECT_NEAR(cycles.y[i], std::cos(kPerTurn * static_cast<double>(i) / 32.0), 1e-3);
}

TEST(TimeSeries, ItsLastPeriodsAreFoundInPhaseWithACycle) {
  std::vector<double> mean;
  for (int i = 0; i < 32; ++i)
    mean.push_back(0.2 + std::cos(kPerTurn * i / 32.0 - 1.0));
  TimeSeries series;
  for (int i = 0; i < 5000; ++i) {
    series.t.push_back(i / 1000.0);
    series.value.push_back(0.2 + std::cos(kPerTurn * (2.0 * series.t.back() - 0.3) - 1.0));
  }
  const double begin = begin_in_phase(series, mean, {0.0, 4.9}, 0.5, 4);
  EXPECT_NEAR(begin, 2.65, 1e-4);  // 0.15 s is where a period begins
  const std::vector<double> periods = series.periods(begin, 0.5, 4, 32);
  ASSERT_EQ(periods.size(), 128U);
  for (std::size_t i = 0; i < periods.size(); ++i)
    EXPECT_NEAR(periods[i], mean[i % 32], 1e-3);
}

TEST(TimeSeries, ItsLastPeriodsAreThoseBeforeItsRampToRest) {
  std::vector<double> mean;
  for (int i = 0; i < 32; ++i)
    mean.push_back(0.2 + std::cos(kPerTurn * i / 32.0));
  TimeSeries series;
  for (int i = 0; i < 8000; ++i) {
    const double t = i / 1000.0;
    const double size = std::clamp((6.4 - t) / 1.0, 0.0, 1.0);  // from 5.4 s on
    series.t.push_back(t);
    series.value.push_back(0.2 + size * std::cos(kPerTurn * 2.0 * t) + 1e-3 * std::sin(917.0 * i));
  }
  const double begin = begin_in_phase(series, mean, {0.0, 7.9}, 0.5, 4);
  EXPECT_NEAR(begin, 3.0, 1e-3);
  EXPECT_EQ(begin_in_phase(series, mean, {0.0, 1.9}, 0.5, 4), 1.9);  // too short
}

TEST(HarmonicCurve, FitsSamplesAtAnyPhases) {
  std::vector<double> tau, y;
  for (int i = 0; i < 1000; ++i) {
    tau.push_back(std::fmod(0.618 * i, 1.0));
    y.push_back(0.5 + std::cos(kPerTurn * tau.back()) -
                0.3 * std::sin(3.0 * kPerTurn * tau.back()) + (i % 2 == 0 ? 0.01 : -0.01));
  }
  const HarmonicCurve curve = fit_harmonics(tau, y, 3);
  const double expected[] = {0.5, 1.0, 0.0, 0.0, 0.0, 0.0, -0.3};
  for (std::size_t k = 0; k < 7; ++k)
    EXPECT_NEAR(curve.coefficients[k], expected[k], 1e-3) << k;
  EXPECT_NEAR(curve.residual, 1000 * 1e-4, 1e-3);
  EXPECT_NEAR(curve.on_grid(4)[1], 0.5 + 0.3, 2e-3);
}

}  // namespace
}  // namespace shaker::estimator
