// What is scored, and what is not: no effect is passed by without a word.
#include "estimator/diagnosis/score/internal/scoring.hpp"

#include <cmath>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/diagnosis/internal/motion_range.hpp"
#include "estimator/diagnosis/noise/internal/transient.hpp"
#include "tests/estimator/diagnosis/free_decay.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::HasSubstr;

config::ModelSpec oscillator(double k) {
  auto model = estimator::testing::linear_oscillator();
  model.effects[0].parameters["c"].start = 0.2;
  model.effects[1].parameters["k"].start = k;
  return model;
}

// A model without an orifice may lack its drag.
TEST(Scoring, NamesTheDragOfAModelThatHasNone) {
  Campaign campaign;
  campaign.runs.push_back(testing::decay_of(
      [](double u, double v) { return 40.0 * u + 0.1 * v + 1.5 * std::fabs(v) * v; }, {}));
  const auto d = diagnose(campaign, oscillator(42.0));
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "orifice_damping");
  EXPECT_GT(d->effects[0].probability, 0.9);
  EXPECT_NEAR(d->effects[0].parameters.at(0).value, 1.5, 0.05);
}

// A pendulum in air, in radians: its sine is in the model's file.
TEST(Scoring, NamesTheDragOfAPendulum) {
  Campaign campaign;
  campaign.runs.push_back(testing::decay_of(
      [](double u, double v) { return 20.0 * std::sin(u) + 0.02 * v + 0.01 * std::fabs(v) * v; },
      {.start = 1.0, .duration = 25.0, .rate = 100.0, .noise = 2e-4}));
  auto model = estimator::testing::linear_oscillator();
  model.length_unit = "rad";
  model.effects[0].parameters["c"].start = 0.02;
  auto& weight = model.effects[1];
  weight = {};
  weight.effect = "weight";
  weight.formula = "k * sin(u)";
  weight.parameters["k"].start = 19.0;
  weight.parameters["k"].lower = 0.0;
  weight.parameters["k"].upper = 1e3;
  weight.parameters["k"].unit = "1/s^2";
  const auto d = diagnose(campaign, model);
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_FALSE(d->effects.empty());
  EXPECT_EQ(d->effects[0].name, "orifice_damping");
  EXPECT_GT(d->effects[0].probability, 0.9);
}

// What a grid lacks to the limit of zero width is known for one model. A signature is of another.
TEST(Scoring, TakesNoLimitOfAnotherModel) {
  auto runs =
      transient_runs({testing::decay_of([](double u, double v) { return 40.0 * u + 0.5 * v; }, {})},
                     oscillator(42.0));
  ASSERT_TRUE(runs) << runs.error().what;
  const HarmonicFit fit = fit_transient(oscillator(42.0), *runs, {});
  ASSERT_TRUE(fit.converged) << fit.trouble;
  Probe probe;
  probe.line = estimator::testing::effect("cubic_stiffness");
  const auto without = signatures_of(fit, runs->data, probe, {});
  std::vector<RunDatum> limited = runs->data;
  const auto size = limited[0].response.size();
  limited[0].to_limit = std::make_shared<const ToLimit>(
      ToLimit{fit.theta, Eigen::VectorXd::Ones(size), Eigen::MatrixXd::Ones(size, 2),
              Eigen::VectorXd::Zero(size)});
  const auto with = signatures_of(fit, limited, probe, {});
  ASSERT_GT(without.columns.cols(), 0) << without.trouble;
  EXPECT_EQ(with.columns, without.columns);
}

// A shape without a motion beside the base model is not integrated again beside a hypothesis: that
// takes long, and rarely gives a motion.
TEST(Scoring, LeavesOutShapesThatHadNoSolutionBefore) {
  auto runs =
      transient_runs({testing::decay_of([](double u, double v) { return 40.0 * u + 0.5 * v; }, {})},
                     oscillator(42.0));
  ASSERT_TRUE(runs) << runs.error().what;
  const HarmonicFit fit = fit_transient(oscillator(42.0), *runs, {});
  ASSERT_TRUE(fit.converged) << fit.trouble;
  std::vector<std::string> notes;
  auto all = candidates(fit.spec, range_of(runs->data), Kind::transient, notes).tried;
  std::erase_if(all, [](const Candidate& c) { return c.effect->name() != "presliding_friction"; });
  ASSERT_EQ(all.size(), 1U);
  ASSERT_GT(all[0].probes.size(), 1U);
  Scoring before = score(fit, runs->data, all, {});
  ASSERT_EQ(before.scores.size(), all[0].probes.size());
  before.scores.erase(before.scores.begin());
  const Scoring again = score(fit, runs->data, all, {}, &before);
  ASSERT_EQ(again.scores.size(), before.scores.size());
  EXPECT_EQ(again.scores[0].probe, before.scores[0].probe);
  EXPECT_EQ(again.scores[0].gain, before.scores[0].gain);
}

// A damper of viscosity and stiffness on a dynamometer, at two frequencies.
std::vector<RunDatum> on_dynamometer() {
  std::vector<RunDatum> data;
  for (const double f : {1.0, 2.5}) {
    RunDatum datum;
    datum.name = "run";
    datum.kind = Kind::imposed_motion;
    datum.frequency_hz = f;
    datum.driver = Eigen::VectorXd::Zero(15);
    datum.driver[1] = 0.01;
    datum.driver[4] = 0.002;
    datum.response = Eigen::VectorXd::Zero(15);
    datum.response[2] = -0.3 * f;
    datum.response[3] = 0.2;
    datum.error = Eigen::VectorXd::Constant(15, 1e-3);
    datum.freedom = Eigen::VectorXd::Constant(15, 20.0);
    data.push_back(std::move(datum));
  }
  return data;
}

Probe probe_of(const std::string& effect, const std::string& coefficient) {
  Probe probe;
  probe.line = estimator::testing::effect(effect);
  probe.line.parameters[coefficient].start = 0.0;
  probe.coefficients = {coefficient};
  return probe;
}

// Along an imposed motion the forces of effects add up: what a probe changes is the same beside
// each fit, and is computed once.
TEST(Scoring, KnowsWhatAnEffectChangesAlongAnImposedMotion) {
  const auto data = on_dynamometer();
  const FitOptions options{128};
  const HarmonicFit fit = fit_harmonics(oscillator(20.0), data, {}, nullptr, options);
  ASSERT_TRUE(fit.converged) << fit.trouble;
  for (const auto& [effect, coefficient] :
       {std::pair("cubic_stiffness", "k3"), {"presliding_friction", "f_c"}}) {
    const Probe probe = probe_of(effect, coefficient);
    const Signatures found = signatures_of(fit, data, probe, options);
    ASSERT_EQ(found.columns.cols(), 1) << effect << found.trouble;
    // In the whole model, at the same points.
    const Model whole(with_line(fit.spec, probe.line));
    const int points = whole.coordinates() > 1 ? options.points / 2 : options.points;
    Eigen::Index row = 0;
    for (const RunDatum& datum : data) {
      Prediction prediction(whole, datum, points);
      ASSERT_TRUE(prediction.at(carried_over(whole, fit)));
      const Eigen::VectorXd column =
          whitened(datum, prediction.jacobian().rightCols(whole.parameter_count() - 2)).col(0);
      EXPECT_LT((found.columns.col(0).segment(row, column.size()) - column).norm(),
                1e-9 * column.norm())
          << effect;
      row += column.size();
    }
    // It is looked at no more: runs whose errors differ have the same change.
    Probed known = found.probed;
    ASSERT_EQ(known.changes.size(), data.size()) << effect;
    known.changes[0].columns *= 2.0;
    auto softened = data;
    for (RunDatum& datum : softened)
      datum.error *= 10.0;
    const Signatures again = signatures_of(fit, softened, probe, options, &known);
    const Eigen::VectorXd changed = 0.2 * found.columns.topRows(15);
    EXPECT_LT((again.columns.topRows(15) - changed).norm(), 1e-12 * changed.norm()) << effect;
    // Of another motion nothing is known.
    softened[0].driver[1] = 0.02;
    const Signatures other = signatures_of(fit, softened, probe, options, &known);
    EXPECT_GT((other.columns.topRows(15) - changed).norm(), 0.1 * changed.norm()) << effect;
  }
}

// Behind a play in the load path an effect sees another motion.
TEST(Scoring, LooksAtAnEffectBehindAPlayBesideEachFit) {
  const auto data = on_dynamometer();
  auto model = oscillator(20.0);
  model.effects.push_back(estimator::testing::effect("free_play"));
  const FitOptions options{128};
  const HarmonicFit fit = fit_harmonics(model, data, {}, nullptr, options);
  ASSERT_TRUE(std::isfinite(fit.chi_squared)) << fit.trouble;
  const auto found = signatures_of(fit, data, probe_of("cubic_stiffness", "k3"), options);
  EXPECT_TRUE(found.trouble.empty()) << found.trouble;
  EXPECT_TRUE(found.probed.changes.empty());
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
