// Campaigns beside each other, the motion of fitted runs, and the areas of a pin.
#include "estimator/fit/run_comparison.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "../fixtures.hpp"
#include "estimator/fit/pin_areas.hpp"

namespace shaker::estimator {
namespace {

using namespace testing;

TEST(Disagreement, NamesTheParameterThatIsFarthestOff) {
  const std::vector<ParameterAlone> one = {{"a", 1.0, 0.01}, {"b", 2.0, 0.01}, {"c", 3.0, 0.01}};
  EXPECT_FALSE(disagreement(one, one));
  auto other = one;
  other[1].value += 0.2;
  other[2].value += 0.3;
  EXPECT_EQ(disagreement(one, other), 2U);
}

TEST(Disagreement, NeedsADifferenceAboveNoiseAndOfSize) {
  const std::vector<ParameterAlone> one = {{"a", 1.0, 0.01}};
  EXPECT_FALSE(disagreement(one, {{"a", 1.1, 0.01}}));                   // 7 standard errors
  EXPECT_EQ(disagreement(one, {{"a", 1.2, 0.01}}), 0U);                  // 14
  EXPECT_FALSE(disagreement({{"a", 1.0, 1e-5}}, {{"a", 1.009, 1e-5}}));  // certain, but small
}

TEST(Disagreement, IsNotAskedOfOtherParameters) {
  EXPECT_FALSE(disagreement({{"a", 1.0, 0.01}}, {{"b", 9.0, 0.01}}));
  EXPECT_FALSE(disagreement({{"a", 1.0, 0.01}}, {}));
}

// The response of a damped linear oscillator to a cosine is a cosine: closed form.
TEST(MotionOfRuns, IsThatOfTheClosedForm) {
  constexpr double damping = 2.0, stiffness = 400.0, amplitude = 3.0, frequency = 2.0;
  constexpr double omega = 2.0 * std::numbers::pi * frequency;
  const double real = stiffness - omega * omega, imaginary = damping * omega;
  const double size = amplitude / std::hypot(real, imaginary);
  const double lag = std::atan2(imaginary, real);
  RunData run;
  run.frequency_hz = frequency;
  run.amplitude = amplitude;
  for (int i = 0; i < 64; ++i)
    run.displacement.push_back(size * std::cos(2.0 * std::numbers::pi * i / 64.0 - lag));
  auto spec = linear_oscillator();
  spec.effects[0].parameters["c"].start = 1.9;
  spec.effects[1].parameters["k"].start = 390.0;
  const Model model(spec);
  Estimator estimator(model, {run});
  ASSERT_EQ(estimator.fit(model.start()).status, FitStatus::converged);
  const MotionOfRuns motion = motion_of_runs(estimator, model);
  EXPECT_NEAR(motion.deepest, size, 1e-3 * size);
  EXPECT_NEAR(motion.fastest, omega * size, 2e-3 * omega * size);
  // One campaign alone: both parameters are determined.
  const auto alone = estimated_alone(model, {run});
  ASSERT_EQ(alone.size(), 2U);
  EXPECT_EQ(alone[0].name, "c");
  EXPECT_NEAR(alone[0].value, damping, 1e-6 * damping);
  EXPECT_NEAR(alone[1].value, stiffness, 1e-6 * stiffness);
}

// Slopes of ln(area) that do not differ: ln(area) falls along a straight line, and its error grows so.
TEST(PinAreas, HaveTheIntervalsOfTheLogarithm) {
  auto spec = model_of({effect("tabulated_pin")});
  spec.effects[0].table = config::PinTable{{0.0, 0.1, 0.2, 0.3}, {80.0, 75.0, 70.0, 60.0}};
  Estimate estimate;
  for (const char* name : {"fall", "r2", "r3"}) {
    ParameterEstimate parameter;
    parameter.name = name;
    parameter.effect = "tabulated_pin";
    estimate.parameters.push_back(parameter);
  }
  ParameterEstimate& fall = estimate.parameters.front();
  fall.value = std::log(2.0);
  fall.standard_error = 0.1;
  fall.lower = fall.value - 0.2;
  fall.upper = fall.value + 0.2;
  estimate.covariance_order = {"fall"};
  estimate.covariance = {0.01};
  const auto areas = pin_areas(spec, estimate);
  ASSERT_EQ(areas.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    const double share = static_cast<double>(i) / 3.0, area = 80.0 * std::pow(0.5, share);
    EXPECT_NEAR(areas[i].area, area, 1e-10) << i;
    EXPECT_NEAR(areas[i].lower, area * std::exp(-0.2 * share), 1e-10) << i;
    EXPECT_NEAR(areas[i].upper, area * std::exp(0.2 * share), 1e-10) << i;
  }
  EXPECT_TRUE(pin_areas(oleo(), estimate).empty());
}

}  // namespace
}  // namespace shaker::estimator
