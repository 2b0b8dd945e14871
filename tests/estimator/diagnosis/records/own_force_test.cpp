// Records that a constant force of their own moves: another preload, another load.
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

constexpr double kLetGo[] = {0.08, 0.05, 0.065};
constexpr double kHardening = 6000.0;  // 1/(m^2 s^2): as much as the linear spring at 0.1 m

// A mass on a hardening spring and a dashpot that is let go three times.
Campaign loaded(double friction, const std::vector<double>& forces, double unit = 1.0) {
  Campaign campaign;
  for (std::size_t r = 0; r < forces.size(); ++r) {
    const auto force = [friction, own = forces[r]](double u, double v) {
      return 60.0 * u + kHardening * u * u * u + 0.4 * v + friction * std::tanh(v / 2e-5) - own;
    };
    Recording run = testing::decay_of(force, {kLetGo[r], 6.0, 100.0, 2e-5, r + 1});
    run.name = "r" + std::to_string(r + 1);
    for (double& u : run.displacement)
      u *= unit;
    campaign.runs.push_back(std::move(run));
  }
  return campaign;
}

Diagnosis of_hardening(const Campaign& campaign, double unit = 1.0) {
  auto model = estimator::testing::linear_oscillator();
  model.effects.push_back(estimator::testing::effect("cubic_stiffness"));
  model.effects[0].parameters["c"].start = 0.6;
  model.effects[1].parameters["k"].start = 50.0;
  model.effects[2].parameters["k3"].start = 5000.0 / unit / unit;
  const auto d = diagnose(campaign, model);
  EXPECT_TRUE(d) << d.error().what;
  return d ? *d : Diagnosis{};
}

TEST(OwnForce, OfEachRecordIsNoMissingEffect) {
  const Diagnosis d = of_hardening(loaded(0.0, {0.05, -0.1, 0.2}));
  EXPECT_EQ(d.verdict, Verdict::adequate);
  EXPECT_THAT(d.warnings, Contains(HasSubstr("by 0.15 m/s^2 (standard deviation; r1")));
  EXPECT_NEAR(d.damper.spread.force, 0.15, 0.002);
  EXPECT_LT(d.gap.before, 5e-5);
  for (const config::EffectSpec& line : d.improved.effects)
    EXPECT_TRUE(line.formula.empty()) << line.effect;
}

TEST(OwnForce, OfEachRecordHidesNoFriction) {
  const Diagnosis d = of_hardening(loaded(0.05, {0.05, -0.1, 0.2}));
  ASSERT_FALSE(d.effects.empty());
  EXPECT_THAT(d.effects[0].name, ::testing::EndsWith("_friction"));
  EXPECT_GT(d.effects[0].probability, 0.5);
  EXPECT_NEAR(d.effects[0].parameters.at(0).value, 0.05, 0.005);
  for (const DamperHypothesis& one : d.damper.hypotheses) {
    EXPECT_EQ(one.model.effects.size(), 3U + one.effects.size());
    for (const ModelNumber& number : one.numbers)
      EXPECT_NO_THROW(value_of(one.model, number)) << number.line << " " << number.symbol;
  }
}

TEST(OwnForce, IsTheSameInMillimetres) {
  const Diagnosis d = of_hardening(loaded(0.0, {0.05, -0.1, 0.2}, 1000.0), 1000.0);
  EXPECT_EQ(d.verdict, Verdict::adequate);
  EXPECT_NEAR(d.damper.spread.force, 150.0, 2.0);
}

TEST(OwnForce, OfRecordsThatAreAlikeIsNotTold) {
  const Diagnosis d = of_hardening(loaded(0.0, {0.0, 0.0, 0.0}));
  EXPECT_EQ(d.verdict, Verdict::adequate);
  EXPECT_THAT(d.warnings, Not(Contains(HasSubstr("constant force"))));
  EXPECT_EQ(d.damper.spread.force, 0.0);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
