#include "estimator/design/plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>

#include "estimator/inference/monte_carlo.hpp"
#include "estimator/model/run_models.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::HasSubstr;

PlanOptions feet() {
  PlanOptions options;
  options.frequencies_hz = {0.7, 1.0, 1.5, 2.0, 3.0};
  options.amplitudes = {2.5, 5.0, 10.0};
  options.theta = testing::kOleoFeet;
  options.noise = 0.0033;
  options.points = 40;
  options.cycles = 1;
  return options;
}

TEST(Plan, SetsWhatCanBeReadWithThreeDigits) {
  EXPECT_EQ(settable(3.4406820699425453), 3.44);
  EXPECT_EQ(settable(14.166666666666666), 14.2);
  EXPECT_EQ(settable(0.19995), 0.2);
  EXPECT_EQ(settable(0.012345), 0.0123);
  EXPECT_EQ(settable(1234.0), 1230.0);
  EXPECT_EQ(settable(7.0), 7.0);
}

// The planned errors are those that an estimate from accurate data states.
TEST(Plan, PromisesTheErrorsThatAnEstimateThenStates) {
  const Model model(testing::oleo(32.178));
  const auto plan = make_plan(model, feet());
  ASSERT_TRUE(plan) << plan.error().what;
  const PlanSet* three = nullptr;
  for (const PlanSet& set : plan->sets) {
    if (set.runs.size() == 3) {
      three = &set;
      break;
    }
  }
  ASSERT_NE(three, nullptr);
  std::vector<RunDesign> design;
  for (const std::size_t r : three->runs)
    design.push_back({plan->candidates[r].frequency_hz, plan->candidates[r].amplitude, 40, 1.0});
  EstimationOptions options;
  options.noise = feet().noise;
  Estimator estimator(model, *exact_data(model, design, testing::kOleoFeet), options);
  const Fit& fit = estimator.fit(testing::kOleoFeet);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(three->error[k] / fit.standard_error[k], 1.0, 1e-5);
}

// Where two parameters have a value in each run, the joint ones and the means of the values get the
// errors that an estimate with all values states.
TEST(Plan, GivesEachRunItsOwnValuesOfWhatVariesPerRun) {
  config::ModelSpec spec = testing::oleo(32.178);
  spec.effects[1].parameters["theta2"].variation.per = "run";
  spec.effects[1].parameters["theta4"].variation.per = "run";
  const Model model(spec);
  const auto plan = make_plan(model, feet());
  ASSERT_TRUE(plan) << plan.error().what;
  const auto three = std::ranges::find_if(
      plan->sets, [](const PlanSet& set) { return set.runs.size() == 3 && set.determined; });
  ASSERT_NE(three, plan->sets.end());
  std::vector<RunDesign> design;
  std::vector<config::RunCondition> conditions;
  for (const std::size_t r : three->runs) {
    design.push_back({plan->candidates[r].frequency_hz, plan->candidates[r].amplitude, 40, 1.0});
    conditions.push_back({"r" + std::to_string(conditions.size()), {}, {}});
  }
  const auto models = run_models(spec, conditions);
  ASSERT_TRUE(models) << models.error().what;
  auto data = *exact_data(Model(testing::oleo(32.178)), design, testing::kOleoFeet);
  for (std::size_t r = 0; r < data.size(); ++r)
    data[r].model = models->of_run[r];
  const std::vector<double>& t = testing::kOleoFeet;
  const std::vector<double> truth = {t[0], t[1], t[1], t[1], t[2], t[3], t[3], t[3]};
  EstimationOptions options;
  options.noise = feet().noise;
  Estimator estimator(models->joint(), data, options);
  const Fit& fit = estimator.fit(truth);
  ASSERT_EQ(fit.status, FitStatus::converged);
  const auto of_mean = [&](std::vector<std::size_t> values) {
    double sum = 0.0;
    for (const std::size_t k : values)
      for (const std::size_t l : values)
        sum += fit.covariance[k * truth.size() + l];
    return std::sqrt(sum) / static_cast<double>(values.size());
  };
  const double wanted[] = {of_mean({0}), of_mean({1, 2, 3}), of_mean({4}), of_mean({5, 6, 7})};
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(three->error[k] / wanted[k], 1.0, 1e-5) << k;
}

// Two stiffnesses of one line cannot both have a value in each run.
TEST(Plan, SaysThatTheRunsDoNotDetermineTheirOwnValues) {
  config::ModelSpec spec = testing::linear_oscillator();
  spec.effects.push_back(spec.effects[1]);
  for (const std::size_t line : {1U, 2U})
    spec.effects[line].parameters["k"].variation.per = "run";
  PlanOptions options;
  options.frequencies_hz = {0.7, 1.5};
  options.amplitudes = {1.0};
  options.noise = 1e-3;
  const auto plan = make_plan(Model(spec), options);
  ASSERT_TRUE(plan) << plan.error().what;
  for (const PlanSet& set : plan->sets) {
    EXPECT_FALSE(set.determined);
    EXPECT_TRUE(std::isfinite(set.error[0]));  // the damping is joint
    EXPECT_TRUE(std::isnan(set.error[1]) && std::isnan(set.error[2]));
  }
}

TEST(Plan, FindsTheSetThatTryingAllOfThemFinds) {
  const Model model(testing::oleo(32.178));
  PlanOptions options = feet();
  options.most_runs = 3;
  const auto plan = make_plan(model, options);
  ASSERT_TRUE(plan);
  double best = std::numeric_limits<double>::infinity();
  double sharpest = best;
  const std::size_t n = plan->candidates.size();
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a; b < n; ++b)
      for (std::size_t c = b; c < n; ++c) {
        if (!plan->candidates[a].refused.empty() || !plan->candidates[b].refused.empty() ||
            !plan->candidates[c].refused.empty())
          continue;
        const PlanSet set = judge(model, options, *plan, {a, b, c});
        best = std::min(best, set.spread);
        if (set.determined) sharpest = std::min(sharpest, set.error[3]);
      }
  for (const PlanSet& set : plan->sets) {
    if (set.runs.size() != 3) continue;
    EXPECT_NEAR(set.spread / best, 1.0, 1e-9);
    break;
  }
  EXPECT_NEAR(plan->sharpest[3].error[3] / sharpest, 1.0, 1e-9);
}

TEST(Plan, SaysBeforehandThatFigure13HardlyDeterminesTheSpring) {
  const Model model(testing::oleo(32.178));
  PlanOptions options = feet();
  options.frequencies_hz = {2.0};
  options.amplitudes = {5.0};
  options.most_runs = 1;
  const auto plan = make_plan(model, options);
  ASSERT_TRUE(plan);
  ASSERT_FALSE(plan->sets[0].warnings.empty());
  EXPECT_THAT(plan->sets[0].warnings[0], HasSubstr("theta4"));
}

// (6.1): no set of runs distinguishes two dampers with the same effect.
TEST(Plan, SaysWhichCombinationNoSetDetermines) {
  const Model model(
      testing::model_of({testing::effect("viscous_damping"), testing::effect("viscous_damping"),
                         testing::effect("linear_stiffness")}));
  PlanOptions options = feet();
  options.theta = {1.0, 2.0, 60.0};
  const auto plan = make_plan(model, options);
  ASSERT_TRUE(plan);
  for (const PlanSet& set : plan->sets) {
    EXPECT_FALSE(set.determined);
    EXPECT_TRUE(std::isnan(set.error[0]));
    EXPECT_TRUE(std::isfinite(set.error[2]));
    ASSERT_FALSE(set.warnings.empty());
    EXPECT_THAT(set.warnings[0], HasSubstr(" with "));
  }
}

TEST(Plan, StaysInsideTheRigsLimits) {
  const Model model(testing::oleo(32.178));
  PlanOptions options = feet();
  options.limits.stroke_min = 0.4;
  options.limits.stroke_max = 0.575;
  options.limits.stroke_rate_max = 0.8;
  options.limits.excitation_max = 8.0;
  options.limits.frequency_min_hz = 0.9;
  options.limits.frequency_max_hz = 2.5;
  const auto plan = make_plan(model, options);
  ASSERT_TRUE(plan);
  for (const PlanSet& set : plan->sets) {
    for (const std::size_t r : set.runs) {
      const PlanCandidate& c = plan->candidates[r];
      EXPECT_LE(c.amplitude, 8.0);
      EXPECT_GE(c.frequency_hz, 0.9);
      EXPECT_LE(c.frequency_hz, 2.5);
      EXPECT_LE(c.stroke_high, 0.575);
      EXPECT_LE(c.rate, 0.8);
    }
  }
  options.limits.stroke_max = 0.45;
  const auto none = make_plan(model, options);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().what, HasSubstr("none of the 15 runs"));
}

TEST(Plan, WorksOnTheOleoOnItsTyreAndTheLinearOscillator) {
  const Model tyre(testing::oleo_on_tyre(0.1));
  PlanOptions options;
  options.theta = testing::kOleoSi;
  options.theta.push_back(900.0);
  options.theta.push_back(2.0);
  options.frequencies_hz = {1.0, 2.0, 4.0};
  options.amplitudes = {1.5, 3.0};
  options.noise = 2e-5;
  auto plan = make_plan(tyre, options);
  ASSERT_TRUE(plan) << plan.error().what;
  EXPECT_EQ(plan->free.size(), 6U);
  // The closed form of the standard error of k of the oscillator: see the Monte Carlo test.
  const Model oscillator(testing::linear_oscillator());
  options.theta = {3.0, 60.0};
  options.frequencies_hz = {1.0};
  options.amplitudes = {2.0};
  options.most_runs = 1;
  options.points = 40;
  options.cycles = 4;
  options.noise = 1e-4;
  plan = make_plan(oscillator, options);
  ASSERT_TRUE(plan);
  const double omega = 2.0 * M_PI;
  const double size2 = 4.0 / std::pow(std::pow(60.0 - omega * omega, 2) + 9.0 * omega * omega, 2);
  EXPECT_NEAR(plan->sets[0].error[1] * std::sqrt(0.5 * 160.0 * size2 / 1e-8), 1.0, 1e-4);
  EXPECT_NEAR(plan->sets[0].seconds, 4.0, 1e-12);
}

TEST(Plan, SaysWhatIsWrongWithItsOptions) {
  const Model model(testing::oleo(32.178));
  PlanOptions options = feet();
  options.noise = 0.0;
  EXPECT_THAT(make_plan(model, options).error().what, HasSubstr("noise"));
  options = feet();
  options.frequencies_hz = {-1.0};
  EXPECT_THAT(make_plan(model, options).error().what, HasSubstr("-1 Hz"));
  options = feet();
  options.amplitudes.clear();
  EXPECT_FALSE(make_plan(model, options));
}

PlanOptions for_the_orifice() {
  PlanOptions options = feet();
  options.aim = {1.0, 0.0, 0.0, 0.0};
  options.minutes = 2.0;
  return options;
}

TEST(Plan, SharesTheRigTimeAsServesTheAim) {
  const Model model(testing::oleo(32.178));
  const PlanOptions options = for_the_orifice();
  const auto plan = make_plan(model, options);
  ASSERT_TRUE(plan) << plan.error().what;
  bool unequal = false;
  for (const PlanSet& set : plan->sets) {
    ASSERT_EQ(set.share.size(), set.runs.size());
    double all = 0.0;
    for (std::size_t i = 0; i < set.runs.size(); ++i) {
      all += set.share[i];
      const double frequency = plan->candidates[set.runs[i]].frequency_hz;
      EXPECT_NEAR(set.cycles[i], 120.0 * set.share[i] * frequency - 10.0, 1e-9);
      unequal =
          unequal || std::fabs(set.share[i] * static_cast<double>(set.runs.size()) - 1.0) > 0.1;
    }
    EXPECT_NEAR(all, 1.0, 1e-12);
    const PlanSet equal = judge(model, options, *plan, set.runs);
    EXPECT_LE(std::log(set.aim_error) + 0.05 * std::log(set.spread),
              std::log(equal.aim_error) + 0.05 * std::log(equal.spread) + 1e-9);
    EXPECT_EQ(set.aim_over_prior, set.aim_error);
  }
  EXPECT_TRUE(unequal);
}

TEST(Plan, ServesTheDampersThatThePriorAllows) {
  const Model model(testing::oleo(32.178));
  PlanOptions options = for_the_orifice();
  std::vector<std::vector<double>> dampers;
  for (const double more : {0.9, 1.0, 1.15}) {
    auto theta = testing::kOleoFeet;
    theta[0] *= more;
    theta[1] *= 2.0 - more;
    dampers.push_back(theta);
    options.prior.push_back({theta, options.aim});
  }
  const auto plan = make_plan(model, options);
  ASSERT_TRUE(plan) << plan.error().what;
  const PlanSet& best = plan->sets.back();
  std::vector<double> errors;
  for (const auto& theta : dampers) {
    PlanOptions there = for_the_orifice();
    there.theta = theta;
    const auto alone = make_plan(model, there);
    ASSERT_TRUE(alone);
    errors.push_back(judge(model, there, *alone, best.runs, best.share).aim_error);
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_NEAR(best.aim_over_prior / errors[1], 1.0, 1e-6);
}

TEST(Plan, TriesFurtherRunsAboutTheBest) {
  const Model model(testing::oleo(32.178));
  PlanOptions options = for_the_orifice();
  const auto coarse = make_plan(model, options);
  options.refinements = 2;
  const auto fine = make_plan(model, options);
  ASSERT_TRUE(coarse && fine);
  EXPECT_GT(fine->candidates.size(), coarse->candidates.size());
  const auto best = [](const Plan& plan) {
    double least = std::numeric_limits<double>::infinity();
    for (const PlanSet& set : plan.sets)
      least = std::min(least, set.aim_error);
    return least;
  };
  EXPECT_LT(best(*fine), best(*coarse));
}

}  // namespace
}  // namespace shaker::estimator
