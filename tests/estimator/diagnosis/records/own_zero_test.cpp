// Records whose sensors stand at zeros of their own.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../free_decay.hpp"
#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kStarts[] = {0.08, 0.05, 0.065};

// A mass on a spring and a dashpot that is let go three times.
Campaign let_go(double friction, const std::vector<double>& zeros) {
  const auto force = [friction](double u, double v) {
    return 60.0 * u + 0.4 * v + friction * std::tanh(v / 2e-5);
  };
  Campaign campaign;
  for (std::size_t r = 0; r < zeros.size(); ++r) {
    Recording run = testing::decay_of(force, {kStarts[r], 6.0, 100.0, 2e-5, r + 1});
    run.name = "r" + std::to_string(r + 1);
    for (double& u : run.displacement)
      u += zeros[r];
    campaign.runs.push_back(std::move(run));
  }
  return campaign;
}

Diagnosis diagnosed(const Campaign& campaign, double stiffness = 50.0) {
  auto model = estimator::testing::linear_oscillator();
  model.effects[0].parameters["c"].start = 0.6;
  model.effects[1].parameters["k"].start = stiffness;
  const auto d = diagnose(campaign, model);
  EXPECT_TRUE(d) << d.error().what;
  return d ? *d : Diagnosis{};
}

TEST(OwnZero, OfEachRecordIsToldAndHidesNothing) {
  const Diagnosis d = diagnosed(let_go(0.05, {1e-3, -2e-3, 1.5e-3}));
  ASSERT_FALSE(d.effects.empty());
  EXPECT_EQ(d.effects[0].name, "coulomb_friction");
  EXPECT_GT(d.effects[0].probability, 0.5);
  EXPECT_NEAR(d.effects[0].parameters.at(0).value, 0.05, 0.002);
  EXPECT_LT(d.gap.after, 0.1 * d.gap.before);
  EXPECT_THAT(d.warnings, Contains(HasSubstr("(standard deviation; r1 +0.0008")));
}

TEST(OwnZero, OfEachRecordIsNoMissingEffect) {
  const Diagnosis d = diagnosed(let_go(0.0, {1e-3, -2e-3, 1.5e-3}));
  EXPECT_EQ(d.verdict, Verdict::adequate);
  EXPECT_LT(d.gap.noise_floor, 1e-4);  // the zeros are not taken for noise
}

TEST(OwnZero, ThatAllRecordsShareIsTheSensorsOffset) {
  const Diagnosis d = diagnosed(let_go(0.0, {1e-3, 1e-3, 1e-3}));
  ASSERT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(d.effects[0].name, "sensor_offset");
  EXPECT_NEAR(d.effects[0].parameters.at(0).value, 1e-3, 1e-4);
  EXPECT_THAT(d.warnings, Not(Contains(HasSubstr("differ in their zero"))));
}

// A mass that hangs on a spring comes to rest wherever the sensor happens to have its zero.
TEST(OwnZero, OfTheOnlyRecordIsToldAndIsNoMissingEffect) {
  const Diagnosis nothing = diagnosed(let_go(0.0, {1e-3}));
  EXPECT_EQ(nothing.verdict, Verdict::adequate);
  EXPECT_THAT(nothing.warnings, Contains(HasSubstr("the record has a zero of its own")));
  const Diagnosis friction = diagnosed(let_go(0.05, {1e-3}));
  ASSERT_EQ(friction.effects.size(), 1U);
  EXPECT_THAT(friction.effects[0].name, ::testing::EndsWith("_friction"));
  EXPECT_THAT(friction.warnings, Contains(HasSubstr("the record has a zero of its own")));
}

// Forces along the measured motion would need a spring that vanishes where the zero is off.
TEST(OwnZero, DoesNotMisleadAStartThatIsFarOff) {
  for (const double stiffness : {6.0, 600.0}) {
    const Diagnosis d = diagnosed(let_go(0.05, {2e-2}), stiffness);
    EXPECT_NEAR(d.parameters_before.at(1).value, 60.0, 0.3);
    ASSERT_FALSE(d.effects.empty());
    EXPECT_THAT(d.effects[0].name, ::testing::EndsWith("_friction"));
  }
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
