#include "estimator/diagnosis/noise/internal/transient.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/diagnosis/force/internal/inverse_dynamics.hpp"
#include "estimator/diagnosis/records/internal/transient_cosines.hpp"
#include "tests/estimator/diagnosis/free_decay.hpp"
#include "tests/estimator/diagnosis/records.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/sanitized.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using testing::campaign_of;
using testing::drifting_oscillator;
using testing::drop;
using testing::oscillator_sweeps;
using testing::sweep;
using testing::Truth;

Campaign drops(const Truth& truth, std::uint64_t seed) {
  return campaign_of({drop(truth, 1.2, seed), drop(truth, 1.8, seed + 1),
                      drop(truth, 2.4, seed + 2), drop(truth, 2.1, seed + 3)},
                     1);
}

TEST(TransientCosines, ReturnACurveAndItsDerivatives) {
  constexpr Eigen::Index kSamples = 120;
  const double length = 3.0, step = length / kSamples;
  Eigen::MatrixXd curves(kSamples, 2);
  Eigen::VectorXd rate(kSamples), bend(kSamples);
  for (Eigen::Index i = 0; i < kSamples; ++i) {
    const double t = (static_cast<double>(i) + 0.5) * step;
    const double w = 4.0 * std::numbers::pi / length;
    curves(i, 0) = 2.0 + std::cos(w * t);
    curves(i, 1) = t;
    rate[i] = -w * std::sin(w * t);
    bend[i] = -w * w * std::cos(w * t);
  }
  const CosineTransform transform(kSamples);
  const Eigen::MatrixXd series = transform.analyse(curves, kSamples);
  EXPECT_NEAR(series(0, 0), 2.0, 1e-12);
  EXPECT_NEAR(series(4, 0), 1.0, 1e-12);
  EXPECT_NEAR(series(0, 1), 0.5 * length, 1e-12);
  EXPECT_LT((transform.synthesise(series.col(1)) - curves.col(1)).norm(), 1e-11);
  EXPECT_LT((transform.synthesise(series.col(0), 1, length) - rate).norm(), 1e-9);
  EXPECT_LT((transform.synthesise(series.col(0), 2, length) - bend).norm(), 1e-8);
  EXPECT_EQ(fast_length(24841), 24576);
}

TEST(Transient, NoiseIsTheFloorAboveAllThatMoves) {
  const auto runs = sampled_runs(oscillator_sweeps({}, 3).runs);
  ASSERT_TRUE(runs) << runs.error().what;
  for (const auto& run : runs->runs) {
    // White noise: the power of a cosine is twice the variance over the number of samples
    // (6000).
    const double expected = 2.0 * 2e-5 * 2e-5 / 6000.0;
    EXPECT_NEAR(run->variance[2] / expected, 1.0, 0.25);
    EXPECT_LT(run->samples(), 1500) << "decimated";
    EXPECT_GT(run->highest_frequency(), 4.0);
  }
}

TEST(Transient, NamesNothingWhereNothingIsMissing) {
  for (const std::uint64_t seed : some({11, 23})) {
    const auto d = diagnose(drops({}, seed), estimator::testing::oleo());
    ASSERT_TRUE(d) << d.error().what;
    EXPECT_EQ(d->verdict, Verdict::adequate) << d->probability_before;
    EXPECT_TRUE(d->effects.empty());
    EXPECT_LT(d->gap.before, 1.2 * d->gap.noise_floor);
  }
}

TEST(Transient, NamesTheFrictionHiddenInADrop) {
  DiagnoseOptions options;
  options.most_effects = 2;  // sets of more take most of the time
  const auto d =
      diagnose(drops({{"coulomb_friction", 0.2}}, 5), estimator::testing::oleo(), options);
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_NE(d->verdict, Verdict::adequate);
  ASSERT_FALSE(d->effects.empty());
  EXPECT_EQ(d->effects[0].name, "coulomb_friction");
  EXPECT_NEAR(d->effects[0].parameters.at(0).value, 0.2, 0.01);
  EXPECT_LT(d->gap.after, 0.1 * d->gap.before);
  ASSERT_TRUE(d->gap.held_out_after);
  EXPECT_LT(*d->gap.held_out_after, 0.15 * *d->gap.held_out_before);
}

TEST(Transient, NamesTheStiffeningSpringOfASweptOscillator) {
  const auto d =
      diagnose(oscillator_sweeps({{"cubic_stiffness", 800.0}}, 7), drifting_oscillator());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "cubic_stiffness");
  EXPECT_NEAR(d->effects[0].parameters.at(0).value, 800.0, 8.0);
  EXPECT_LT(d->gap.after, 1.1 * d->gap.noise_floor);
}

// A spring that the model lacks moves the oleo's rest position: several bounds limit the first
// step.
TEST(Transient, FitsAModelFarFromTheRecords) {
  const Truth hidden = {{"cubic_stiffness", 4000.0}};
  auto model = estimator::testing::oleo();
  model.effects[1].parameters["theta4"].upper = 2.0;
  const auto runs = transient_runs(campaign_of({sweep("oleo", hidden, 0.5, 4.0, 2.0, 12.0, 1),
                                                sweep("oleo", hidden, 0.7, 3.5, 2.5, 12.0, 2)})
                                       .runs,
                                   model);
  ASSERT_TRUE(runs) << runs.error().what;
  const HarmonicFit fit = fit_transient(model, *runs, {});
  EXPECT_TRUE(fit.trouble.empty()) << fit.trouble;
  for (std::size_t r = 0; r < runs->data.size(); ++r) {
    const Eigen::VectorXd& seen = runs->data[r].response;
    const Eigen::VectorXd left = seen - fit.predictions[r].value();
    const auto moving = seen.size() - 1;  // without the mean
    EXPECT_LT(left.tail(moving).norm(), 0.1 * seen.tail(moving).norm());
  }
}

// The gas column of the start values is shorter than the measured stroke: the model has no force
// there.
TEST(Transient, FitsDropsFromAGasColumnThatIsTooShort) {
  auto model = estimator::testing::oleo();
  const auto runs = transient_runs(drops({}, 11).runs, model);
  ASSERT_TRUE(runs) << runs.error().what;
  double deepest = 0.0;
  for (const RunDatum& datum : runs->data)
    deepest = std::max(deepest, datum.sampled->u.maxCoeff());
  model.effects[1].parameters["theta3"].start = 1.1 / deepest;
  const HarmonicFit fit = fit_transient(model, *runs, {});
  ASSERT_TRUE(fit.trouble.empty()) << fit.trouble;
  EXPECT_LT(fit.chi_squared, 1.5 * fit.observations);
  EXPECT_NEAR(fit.theta[0], 16.6667, 0.02);
  EXPECT_NEAR(fit.theta[2], 5.31496, 0.02);
}

// A damper that the model is far from: its response is closed by steps that each take only a part
// of the rest.
TEST(Transient, FitsDropsOfADamperWithStrongFriction) {
  auto model = estimator::testing::oleo();
  const auto runs = transient_runs(drops({{"coulomb_friction", 2.5}}, 11).runs, model);
  ASSERT_TRUE(runs) << runs.error().what;
  const HarmonicFit fit = fit_transient(model, *runs, {});
  ASSERT_TRUE(fit.trouble.empty()) << fit.trouble;
  for (std::size_t r = 0; r < runs->data.size(); ++r) {
    const Eigen::VectorXd& seen = runs->data[r].response;
    const Eigen::VectorXd left = seen - fit.predictions[r].value();
    const auto moving = seen.size() - 1;  // without the mean
    EXPECT_LT(left.tail(moving).norm(), 0.15 * seen.tail(moving).norm());
  }
}

// Much is left by the best fit, and the slopes alone lead there by steps that are far too short: of
// the parameters, and of the initial state.
TEST(Transient, FitsSuchDropsFromStartValuesAThirdOff) {
  const Truth hidden = {{"coulomb_friction", 2.5}};
  const std::vector<std::array<double, 4>> factors = {
      {1.33, 0.75, 1.05, 0.85}, {0.75, 1.33, 1.05, 1.15}, {0.75, 0.75, 1.1, 0.85}};
  std::vector<double> left;
  for (const auto& by : factors) {
    auto model = estimator::testing::oleo();
    const std::vector<double> start = Model(model).start();
    model.effects[0].parameters["theta1"].start = by[0] * start[0];
    model.effects[1].parameters["theta2"].start = by[1] * start[1];
    model.effects[1].parameters["theta3"].start = by[2] * start[2];
    model.effects[1].parameters["theta4"].start = by[3] * start[3];
    const auto runs = transient_runs(drops(hidden, 11).runs, model);
    ASSERT_TRUE(runs) << runs.error().what;
    FitOptions options;
    options.max_iterations = 120;
    const HarmonicFit fit = fit_transient(model, *runs, options);
    ASSERT_TRUE(fit.trouble.empty()) << fit.trouble;
    left.push_back(fit.chi_squared);
  }
  EXPECT_NEAR(left[1], left[0], 0.02 * left[0]);
  EXPECT_NEAR(left[2], left[0], 0.02 * left[0]);
}

// A dynamometer that imposes a motion without a period: friction and viscous damping.
Recording shaken(double friction, std::uint64_t seed) {
  std::mt19937_64 source(seed);
  std::normal_distribution<double> normal;
  std::vector<double> amplitude, frequency, phase;
  for (int k = 0; k < 12; ++k) {
    frequency.push_back(0.3 + 0.21 * k + 0.05 * normal(source));
    amplitude.push_back(4e-3 * std::fabs(normal(source)) / (1.0 + 0.2 * k));
    phase.push_back(6.28 * normal(source));
  }
  Recording r;
  r.kind = Kind::imposed_motion;
  r.role_given = true;
  for (int i = 0; i < 4000; ++i) {
    const double t = i / 200.0;
    double u = 0.0, v = 0.0;
    for (std::size_t k = 0; k < frequency.size(); ++k) {
      const double w = 2.0 * std::numbers::pi * frequency[k];
      u += amplitude[k] * std::sin(w * t + phase[k]);
      v += amplitude[k] * w * std::cos(w * t + phase[k]);
    }
    r.t.push_back(t);
    r.displacement.push_back(u);
    r.force.push_back(3.0 * v + friction * (v > 0.0 ? 1.0 : -1.0) + 0.002 * normal(source));
  }
  return r;
}

// Of friction, a zero and a drift of the sensor the model knows nothing. Without an excitation nothing
// says how large a force is, and slow errors of the sensor look like forces.
TEST(Transient, FitsDecaysOfASensorThatDrifts) {
  constexpr double kStiffness = 100.0, kDamping = 0.4, kFriction = 0.4, kZero = 4e-3, kDrift = 1e-3;
  std::vector<Recording> decays;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    auto decay = testing::decay_of(
        [](double u, double v) {
          return kStiffness * u + kDamping * v + kFriction * std::tanh(v / 1e-3);
        },
        {.start = 0.02 * static_cast<double>(seed), .duration = 8.0, .rate = 100.0, .seed = seed});
    for (std::size_t i = 0; i < decay.t.size(); ++i)
      decay.displacement[i] += kZero + kDrift * decay.t[i];
    decays.push_back(std::move(decay));
  }
  const auto campaign = campaign_of(std::move(decays));
  auto runs = transient_runs(campaign.runs, drifting_oscillator());
  ASSERT_TRUE(runs) << runs.error().what;
  const HarmonicFit fit = fit_transient(drifting_oscillator(), *runs, {});
  ASSERT_TRUE(fit.trouble.empty()) << fit.trouble;
  EXPECT_NEAR(fit.theta[0] / kStiffness, 1.0, 0.1);
}

TEST(Transient, NamesTheStepsOfASensorThatAreMoreThanItsNoise) {
  constexpr double kStep = 5e-4;
  std::vector<Recording> decays;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    auto decay = testing::decay_of([](double u, double v) { return 100.0 * u + 0.4 * v; },
                                   {.start = 0.02 * static_cast<double>(seed),
                                    .duration = 8.0,
                                    .rate = 100.0,
                                    .noise = 5e-5,
                                    .seed = seed});
    for (double& u : decay.displacement)
      u = kStep * std::round(u / kStep);
    decays.push_back(std::move(decay));
  }
  const auto said = diagnose(campaign_of(std::move(decays)), drifting_oscillator());
  ASSERT_TRUE(said) << said.error().what;
  EXPECT_EQ(said->verdict, Verdict::explained);
  ASSERT_EQ(said->effects.size(), 1U);
  EXPECT_EQ(said->effects[0].name, "sensor_quantisation");
  EXPECT_NEAR(said->effects[0].parameters.at(0).value, kStep, 1e-9);
}

// A model with a tyre is not carried along a measured stroke: where it is the answer, its curves have
// no missing force.
TEST(Transient, KnowsNoMissingForceOfAModelWithASecondMass) {
  const auto campaign = drops({}, 30);
  auto model = estimator::testing::oleo();
  model.effects.push_back(estimator::testing::effect("tyre"));
  auto runs = transient_runs(campaign.runs, estimator::testing::oleo());
  ASSERT_TRUE(runs) << runs.error().what;
  const Model with_tyre(model);
  const Prediction prediction(with_tyre, runs->data.front(), 0);
  const auto missing = missing_force(prediction, with_tyre.start(), runs->data.front().response);
  EXPECT_FALSE(missing.ok);
  EXPECT_EQ(missing.force.size(), missing.stroke.size());
}

TEST(Transient, NamesFrictionAlongAnImposedMotionWithoutAPeriod) {
  const auto model = estimator::testing::model_of({estimator::testing::effect("viscous_damping")});
  const auto quiet = diagnose(campaign_of({shaken(0.0, 1), shaken(0.0, 2)}, 1), model);
  ASSERT_TRUE(quiet) << quiet.error().what;
  EXPECT_TRUE(quiet->effects.empty());
  const auto d = diagnose(campaign_of({shaken(0.3, 1), shaken(0.3, 2)}, 1), model);
  ASSERT_TRUE(d) << d.error().what;
  ASSERT_FALSE(d->effects.empty());
  EXPECT_EQ(d->effects[0].name, "coulomb_friction");
  EXPECT_NEAR(d->effects[0].parameters.at(0).value, 0.3, 0.01);
  EXPECT_LT(d->gap.after, 0.2 * d->gap.before);
}

void refused(const Campaign& campaign, const std::string& words) {
  const auto d = diagnose(campaign, drifting_oscillator());
  ASSERT_FALSE(d);
  EXPECT_THAT(d.error().what, ::testing::HasSubstr(words));
}

void clip(Recording& run) {
  const auto& u = run.displacement;
  const double limit = 0.5 * *std::max_element(u.begin(), u.end());
  for (double& value : run.displacement)
    value = std::min(value, limit);
}

TEST(Transient, LeavesOutARunThatNoModelCanExplainAndGoesOn) {
  Campaign campaign = oscillator_sweeps({{"cubic_stiffness", 4000.0}}, 1);
  clip(campaign.runs[0]);
  auto d = diagnose(campaign, drifting_oscillator());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_THAT(d->warnings, ::testing::Contains(::testing::AllOf(::testing::HasSubstr("run r1"),
                                                                ::testing::HasSubstr("clipped"),
                                                                ::testing::HasSubstr("left out"))));
  EXPECT_EQ(d->runs.size(), 2U);
  ASSERT_FALSE(d->effects.empty());
  EXPECT_EQ(d->effects[0].name, "cubic_stiffness");
  for (double& x : campaign.runs[1].excitation)
    x = 1.5;
  refused(campaign, "no run can be used: run r1: the displacement stays on its highest value");
}

// A joint that sticks where it turns, on an even clock: between two encoder counts a resampled curve has
// steps of any size.
TEST(Transient, TakesARecordThatEasesIntoItsHighestValueAndRestsThere) {
  std::vector<Recording> records = oscillator_sweeps({}, 1).runs;
  std::vector<double>& u = records[0].displacement;
  const double top = 1.1 * *std::max_element(u.begin(), u.end());
  for (std::size_t i = 2000; i < 2400; ++i)
    u[i] = i < 2100 ? top - 0.02 * std::exp(-0.1 * static_cast<double>(i - 2000)) : top;
  u[2400] = top - 2e-6;
  for (std::size_t i = 2401; i < 2500; ++i)
    u[i] = top - 0.02 * (1.0 - std::exp(-0.05 * static_cast<double>(i - 2400)));
  u[10] = u[9] + 1e-12;
  const auto runs = sampled_runs(records);
  ASSERT_TRUE(runs) << runs.error().what;
  EXPECT_THAT(runs->left_out, ::testing::IsEmpty());
}

TEST(Transient, LeavesOutARecordWhoseSamplesAreMostlyMissingAndOneThatIsTooShort) {
  std::vector<Recording> records = oscillator_sweeps({}, 1).runs;
  const std::size_t good = records.size();
  records.push_back(records[0]);
  records.back().name = "gaps";
  double later = 0.0;
  for (std::size_t i = 0; i < records.back().t.size(); ++i)
    records.back().t[i] += later += i % 20 == 0 ? 3.0 : 0.0;
  records.push_back(records[0]);
  records.back().name = "short";
  for (auto* column : {&records.back().t, &records.back().displacement, &records.back().excitation})
    column->resize(20);
  const auto runs = sampled_runs(records);
  ASSERT_TRUE(runs) << runs.error().what;
  EXPECT_EQ(runs->runs.size(), good);
  EXPECT_THAT(runs->left_out, ::testing::ElementsAre(
                                  ::testing::HasSubstr("run gaps: samples are missing at so many"),
                                  ::testing::HasSubstr("run short: 20 samples are too few")));
}

TEST(Transient, SaysWhatIsWrongWithARecord) {
  const Campaign good = oscillator_sweeps({}, 1);
  Campaign bad = good;
  bad.runs[0].excitation.pop_back();
  refused(bad, "not on one clock");
  bad = good;
  std::swap(bad.runs[0].t[10], bad.runs[0].t[11]);
  refused(bad, "time does not increase");
  bad = good;
  for (Recording& run : bad.runs) {
    for (std::size_t i = 0; i < run.t.size(); ++i)
      run.t[i] += 3.0 * static_cast<double>(i / 20);
  }
  refused(bad, "samples are missing at so many places");
  bad = good;
  bad.runs[1].kind = Kind::periodic;
  refused(bad, "different kinds");
  bad = good;
  bad.runs[1] = bad.runs[0];
  bad.runs[1].name = "again";
  for (double& u : bad.runs[1].displacement)
    u *= 1.3;
  refused(bad, "contradict each other");
}

// `x` in a formula is the excitation: a pendulum written with sin(x) has no spring.
TEST(Transient, SaysThatAFreeMotionNeedsASpring) {
  const Campaign swing = campaign_of({testing::decay_of(
      [](double u, double v) { return 30.0 * std::sin(u) + 0.1 * v; }, {.start = 1.0})});
  auto moment = estimator::testing::effect("moment");
  moment.formula = "w2 * sin(x)";
  moment.parameters["w2"].start = 25.0;
  const auto model =
      estimator::testing::model_of({moment, estimator::testing::effect("viscous_damping")});
  const auto answer = diagnose(swing, model);
  ASSERT_FALSE(answer);
  EXPECT_THAT(answer.error().what, ::testing::HasSubstr("a formula with u, the displacement"));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
