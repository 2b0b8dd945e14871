// Effects that are only found together.
#include "estimator/diagnosis/select/internal/pairs.hpp"

#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/diagnosis/free_decay.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// A scoring over three data, without a parameter.
class Scored {
 public:
  Scored() { scoring_.design.jacobian = Eigen::MatrixXd::Zero(3, 0); }
  void residual(double x, double y, double z) { scoring_.residual = Eigen::Vector3d(x, y, z); }
  void add(const Candidate& candidate, double x, double y, double z, int sign) {
    Signature signature;
    signature.direction = Eigen::Vector3d(x, y, z).normalized();
    signature.visible = 1.0;
    signature.sign = sign;
    Score score;
    score.candidate = &candidate;
    score.gain = gain_of(signature, scoring_.residual);
    scoring_.design.signatures.push_back(signature);
    scoring_.scores.push_back(score);
  }
  const Scoring& scoring() const { return scoring_; }

 private:
  Scoring scoring_;
};

Candidate named(const std::string& effect) {
  Candidate candidate;
  candidate.probes.emplace_back().line.effect = effect;
  return candidate;
}

TEST(Pairs, HoldAnEffectThatHasTheWrongSignAlone) {
  const Candidate friction = named("coulomb_friction"), drag = named("orifice_damping");
  Scored scored;
  scored.residual(1.0, 0.5, 0.0);
  scored.add(friction, 1.0, 0.0, 0.0, 1);
  scored.add(drag, -1.0, 1.0, 0.0, 1);
  EXPECT_EQ(scored.scoring().scores[1].gain, 0.0);
  const auto pairs = joint_scores(scored.scoring(), 0.01);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_EQ(pairs[0].first, 0U);
  EXPECT_NEAR(pairs[0].gain, 1.25, 1e-12);  // the whole residual
}

TEST(Pairs, HaveAdmissibleSignsAndAreNotOneEffectTwice) {
  const Candidate friction = named("coulomb_friction"), drag = named("orifice_damping"),
                  stribeck = named("stribeck_friction");
  Scored scored;
  scored.residual(1.0, -0.5, 0.0);
  scored.add(friction, 1.0, 0.0, 0.0, 1);
  scored.add(drag, -1.0, 1.0, 0.0, 1);
  scored.add(friction, 1.0, 1.0, 0.0, 0);
  scored.add(stribeck, 0.0, 1.0, 0.0, 0);
  EXPECT_TRUE(joint_scores(scored.scoring(), 0.01).empty());
}

TEST(Pairs, OfTheSameKindsAreTheBestOnly) {
  const Candidate friction = named("coulomb_friction"), drag = named("orifice_damping"),
                  laminar = named("laminar_orifice"), gain = named("sensor_gain");
  Scored scored;
  scored.residual(1.0, 0.5, 0.2);
  scored.add(friction, 1.0, 0.0, 0.0, 0);
  scored.add(drag, 0.0, 1.0, 0.0, 0);
  scored.add(laminar, 0.0, 1.0, 0.1, 0);
  scored.add(gain, 0.0, 0.0, 1.0, 0);
  const auto pairs = joint_scores(scored.scoring(), 0.01);
  ASSERT_EQ(pairs.size(), 4U);  // friction or a damping with the gain, both, and both dampings
  EXPECT_EQ(pairs[0].first, 0U);
  EXPECT_EQ(pairs[0].second, 2U);  // laminar_orifice gains more than orifice_damping
  for (std::size_t k = 1; k < pairs.size(); ++k)
    EXPECT_LE(pairs[k].gain, pairs[k - 1].gain);
}

// One swing of a pendulum from 1.4 rad. The viscous damping of the model stands in for both.
TEST(Pairs, OfDragAndFrictionAreNamed) {
  const auto force = [](double u, double v) {
    return 30.0 * std::sin(u) + 0.003 * v + 0.006 * v * std::fabs(v) + 0.05 * std::tanh(v / 1e-3);
  };
  auto model = estimator::testing::model_of({estimator::testing::effect("viscous_damping")});
  config::EffectSpec sine;
  sine.effect = "pendulum";
  sine.formula = "w2 * sin(u)";
  sine.parameters["w2"].start = 29.0;
  model.effects.push_back(sine);
  Campaign campaign;
  campaign.runs.push_back(testing::decay_of(force, {1.4, 25.0, 60.0, 3e-4, 1}));
  const auto d = diagnose(campaign, model);
  ASSERT_TRUE(d) << d.error().what;
  std::vector<std::string> names;
  for (const NamedEffect& effect : d->effects)
    names.push_back(effect.name);
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("coulomb_friction", "orifice_damping"));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
