#include "estimator/fit/estimation.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include <gmock/gmock.h>

#include "tests/estimator/benchmark_jobs.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::HasSubstr;
using testing::job1;
using testing::job2;
using testing::kOleoFeet;
using testing::kOleoSi;

struct Reference {
  std::vector<double> theta, covariance;
  double sum_of_squares;
};
Reference reference(const std::string& file) {
  const auto rows = testing::read_csv(file, false);
  return {rows[0], rows[2], rows[1][0]};
}

std::vector<double> five_per_cent_above(std::vector<double> theta) {
  for (double& t : theta)
    t *= 1.05;
  return theta;
}

EstimationOptions with(Method method, int points = 160) {
  EstimationOptions options;
  options.method = method;
  options.grid.points = points;
  return options;
}

class EveryMethod : public ::testing::TestWithParam<Method> {};

TEST_P(EveryMethod, FindsTheExactOptimumOfOneRun) {
  const Model model(testing::oleo(32.2));
  Estimator estimator(model, {job1()}, with(GetParam(), 320));
  const Fit& fit = estimator.fit(five_per_cent_above(kOleoFeet));
  const Reference want = reference("oleo_j1_reference.csv");
  ASSERT_EQ(fit.status, FitStatus::converged);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(fit.theta[k] / want.theta[k], 1.0, 5e-8);
  EXPECT_NEAR(fit.sum_of_squares / want.sum_of_squares, 1.0, 1e-6);
  for (int i = 0; i < 16; ++i)
    EXPECT_NEAR(fit.covariance[i], want.covariance[i], 2e-5 * std::fabs(want.covariance[i]));
}

TEST_P(EveryMethod, BeginsWithoutATraceOfTheFitBefore) {
  const Model model(testing::oleo(32.2));
  EstimationOptions options = with(GetParam(), 160);
  options.keep_iterates = true;
  Estimator estimator(model, {job1()}, options);
  const auto start = five_per_cent_above(kOleoFeet);
  const auto alone = estimator.fit(start).iterates;
  RunData other = job1();
  for (double& value : other.displacement)
    value *= 30.0;
  estimator.update_run(0, other);
  estimator.fit(start);
  estimator.update_run(0, job1());
  EXPECT_EQ(estimator.fit(start).iterates, alone) << "to the last bit";
}

TEST_P(EveryMethod, FindsTheExactOptimumOfTwelveRunsJointly) {
  const Model model(testing::oleo(32.2));
  Estimator estimator(model, job2(), with(GetParam(), 320));
  const Fit& fit = estimator.fit(five_per_cent_above(kOleoFeet));
  const Reference want = reference("oleo_j2_reference.csv");
  ASSERT_EQ(fit.status, FitStatus::converged);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(fit.theta[k] / want.theta[k], 1.0, 1e-7);
  EXPECT_NEAR(fit.sum_of_squares / want.sum_of_squares, 1.0, 1e-6);
  for (int i = 0; i < 16; ++i)
    EXPECT_NEAR(fit.covariance[i], want.covariance[i], 1e-4 * std::fabs(want.covariance[i]));
}

INSTANTIATE_TEST_SUITE_P(Methods, EveryMethod,
                         ::testing::Values(Method::lifted, Method::gauss_newton,
                                           Method::levenberg_marquardt));

// The discretisation error is below 1e-6 of theta on the grid of the benchmark.
TEST(Estimator, HasADiscretisationErrorBelowOneMillionthOnTheBenchmarksGrid) {
  const Model model(testing::oleo(32.2));
  Estimator estimator(model, {job1()}, with(Method::lifted, 80));
  const Fit& fit = estimator.fit(five_per_cent_above(kOleoFeet));
  const Reference want = reference("oleo_j1_reference.csv");
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(fit.theta[k] / want.theta[k], 1.0, 1e-6);
}

TEST(Estimator, ConvergesFromFarStartsThroughItsFallback) {
  const Model model(testing::oleo(32.2));
  const Reference want = reference("oleo_j1_reference.csv");
  for (const std::vector<double>& start :
       {std::vector<double>{1.0, 9.0, 1.2, 1.4}, {12.0, 2.0, 1.0, 0.7}, {5.0, 5.0, 3.0, 1.0}}) {
    Estimator estimator(model, {job1()}, with(Method::lifted));
    const Fit& fit = estimator.fit(start);
    ASSERT_EQ(fit.status, FitStatus::converged) << start[0] << ": " << fit.trouble;
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(fit.theta[k] / want.theta[k], 1.0, 1e-6) << start[0];
  }
}

TEST(Estimator, ReadsSamplesAtArbitraryTimesAsWellAsEqualSteps) {
  const Model model(testing::oleo(32.2));
  RunData scattered = job1();
  const auto order = std::vector<int>{7, 3, 0, 39, 20};
  for (std::size_t j = 0; j < 40; ++j)
    scattered.tau.push_back(static_cast<double>(j) / 40.0);
  // The same record in another order and one period later.
  std::swap(scattered.tau[3], scattered.tau[30]);
  std::swap(scattered.displacement[3], scattered.displacement[30]);
  for (const int j : order)
    scattered.tau[static_cast<std::size_t>(j)] += 2.0;
  Estimator estimator(model, {scattered}, with(Method::lifted, 240));
  const Fit& fit = estimator.fit(five_per_cent_above(kOleoFeet));
  const Reference want = reference("oleo_j1_reference.csv");
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(fit.theta[k] / want.theta[k], 1.0, 1e-6);
}

TEST(Estimator, WeighsARunOfNCyclesAsNRunsOfOne) {
  const Model model(testing::oleo(32.2));
  auto runs = job2();
  runs.resize(2);
  auto many = runs;
  many.push_back(runs[1]);
  many.push_back(runs[1]);
  runs[1].cycles = 3.0;
  Estimator once(model, runs, with(Method::lifted)), thrice(model, many, with(Method::lifted));
  const Fit& a = once.fit(kOleoFeet);
  const Fit& b = thrice.fit(kOleoFeet);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(a.theta[k], b.theta[k], 1e-9);
  EXPECT_NEAR(a.sum_of_squares, b.sum_of_squares, 1e-12);
  EXPECT_EQ(a.observations, b.observations);
  for (int i = 0; i < 16; ++i)
    EXPECT_NEAR(a.covariance[i] / b.covariance[i], 1.0, 1e-6);
}

TEST(Estimator, StopsAtBoundsAndSaysSo) {
  auto spec = testing::oleo(32.2);
  spec.effects[1].parameters["theta4"].lower = 1.1;
  spec.effects[1].parameters["theta4"].start = 1.2;
  spec.effects[1].parameters["theta4"].upper = 1.6;
  const Model model(spec);
  Estimator estimator(model, {job1()}, with(Method::lifted));
  const Fit& fit = estimator.fit({5.0, 5.0, 1.5, 1.2});
  ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  EXPECT_DOUBLE_EQ(fit.theta[3], 1.1);
  EXPECT_TRUE(fit.at_bound[3]);
  const Estimate estimate = estimator.describe();
  EXPECT_FALSE(estimate.usable);
  ASSERT_FALSE(estimate.warnings.empty());
  EXPECT_THAT(estimate.warnings[0], HasSubstr("theta4"));
  // The other parameters are at the optimum of the problem with theta4 fixed there.
  spec.effects[1].parameters["theta4"].start = 1.1;
  spec.effects[1].parameters["theta4"].fixed = true;
  const Model fixed(spec);
  Estimator reduced(fixed, {job1()}, with(Method::lifted));
  const Fit& other = reduced.fit({5.0, 5.0, 1.5, 1.1});
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(fit.theta[k] / other.theta[k], 1.0, 1e-7);
  EXPECT_EQ(other.standard_error[3], 0.0);
}

// (6.1) of the paper: two parameters of which only the sum has an effect.
TEST(Estimator, SaysWhichParametersTheDataDoNotDetermine) {
  const Model model(
      testing::model_of({testing::effect("viscous_damping"), testing::effect("viscous_damping"),
                         testing::effect("linear_stiffness")}));
  const Model truth(testing::linear_oscillator());
  PeriodicSystem system(truth, {Scheme::fourier, 64, false});
  system.set_excitation(1.0, 2.0);
  system.solve_from_rest(std::vector<double>{3.0, 60.0});
  RunData run;
  run.frequency_hz = 1.0;
  run.amplitude = 2.0;
  std::mt19937_64 random(6);
  std::normal_distribution<double> noise(0.0, 1e-4);
  for (int i = 0; i < 64; ++i)
    run.displacement.push_back(system.value(i, 0) + noise(random));
  Estimator estimator(model, {run}, with(Method::lifted));
  const Fit& fit = estimator.fit({1.0, 1.0, 50.0});
  EXPECT_EQ(fit.status, FitStatus::undetermined);
  EXPECT_FALSE(fit.determined[0]);
  EXPECT_FALSE(fit.determined[1]);
  EXPECT_TRUE(fit.determined[2]);
  EXPECT_NEAR(fit.theta[0] + fit.theta[1], 3.0, 0.1);
  EXPECT_TRUE(std::isnan(fit.standard_error[0]));
  const Estimate estimate = estimator.describe();
  EXPECT_FALSE(estimate.usable);
  EXPECT_THAT(estimate.warnings[0], HasSubstr("do not determine"));
}

// Two identical dampers and a spring: the error of the spring equals that in a model with one
// damper, with any source of error, and in closed form. With D = k - w^2 + i w c and the
// response A / D, the derivatives by k and c are orthogonal. So s sqrt(2 / n) |D|^2 / A is the
// error from noise s in n samples, and e |D| / A that from an error e of the parts of the
// excitation.
TEST(Estimator, KnowsWhatIsDeterminedBesideWhatIsNot) {
  const double omega = 2.0 * std::numbers::pi, a = 2.0, c = 3.0, k = 60.0, s = 1e-4, e = 1e-3;
  const std::complex<double> d(k - omega * omega, omega * c);
  RunData run;
  run.frequency_hz = 1.0;
  run.amplitude = a;
  run.excitation_error = e;
  for (int i = 0; i < 64; ++i)
    run.displacement.push_back(std::real(a / d * std::polar(1.0, omega * i / 64.0)));
  EstimationOptions options = with(Method::lifted);
  options.noise = s;
  auto spec = testing::linear_oscillator();
  const Model one(spec);
  spec.effects.insert(spec.effects.begin(), testing::effect("viscous_damping"));
  const Model two(spec);
  Estimator alike(two, {run}, options), alone(one, {run}, options);
  const Fit& fit = alike.fit({1.0, 1.0, 50.0});
  const Fit& reduced = alone.fit({2.0, 50.0});
  EXPECT_EQ(fit.status, FitStatus::undetermined);
  EXPECT_FALSE(fit.determined[0]);
  EXPECT_FALSE(fit.determined[1]);
  ASSERT_TRUE(fit.determined[2]);
  EXPECT_NEAR(fit.theta[2], k, 1e-5);
  EXPECT_EQ(fit.degrees_of_freedom, reduced.degrees_of_freedom);
  const double noise = s * std::sqrt(2.0 / 64.0) * std::norm(d) / a, table = e * std::abs(d) / a;
  EXPECT_NEAR(fit.standard_error[2] / std::hypot(noise, table), 1.0, 1e-4);
  EXPECT_NEAR(fit.standard_error[2] / reduced.standard_error[1], 1.0, 1e-6);
  EXPECT_NEAR(fit.covariance[8] / reduced.covariance[3], 1.0, 1e-6);
  EXPECT_TRUE(std::isnan(fit.covariance[0]));
  EXPECT_TRUE(std::isnan(fit.covariance[2]));
  EXPECT_NEAR(fit.quantile, reduced.quantile, 1e-12);
  const Estimate estimate = alike.describe();
  EXPECT_FALSE(estimate.usable);
  EXPECT_TRUE(estimate.parameters[2].determined);
  EXPECT_LT(estimate.parameters[2].lower, k);
  EXPECT_GT(estimate.parameters[2].upper, k);
}

// Over two periods the harmonics of the excitation are every other harmonic. The same samples,
// counted once over the longer period, must give the same error.
TEST(Estimator, CountsTheExcitationsErrorOverSeveralPeriodsToo) {
  RunData once;
  once.frequency_hz = 1.0;
  once.amplitude = 2.0;
  once.excitation_error = 1e-3;
  once.cycles = 2.0;
  const double omega = 2.0 * std::numbers::pi;
  const std::complex<double> response = 2.0 / std::complex<double>(60.0 - omega * omega, omega * 3);
  for (int i = 0; i < 64; ++i)
    once.displacement.push_back(std::real(response * std::polar(1.0, omega * i / 64.0)));
  RunData twice = once;
  twice.periods = 2;
  twice.cycles = 1.0;
  twice.displacement.insert(twice.displacement.end(), once.displacement.begin(),
                            once.displacement.end());
  EstimationOptions options = with(Method::lifted);
  options.noise = 1e-4;
  const Model model(testing::linear_oscillator());
  Estimator one(model, {once}, options), two(model, {twice}, options);
  const Fit& fit = one.fit({2.0, 50.0});
  const Fit& over_two = two.fit({2.0, 50.0});
  ASSERT_EQ(over_two.status, FitStatus::converged);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(over_two.covariance[i], fit.covariance[i], 1e-6 * fit.covariance[0]);
  once.excitation_error = 0.0;
  Estimator exact(model, {once}, options);
  EXPECT_LT(exact.fit({2.0, 50.0}).covariance[0], 0.9 * fit.covariance[0]);
}

// The same with Fourier coefficients whose covariance comes from few cycles.
TEST(Estimator, KnowsWhatIsDeterminedFromCoefficientsToo) {
  const double omega = 2.0 * std::numbers::pi;
  const std::complex<double> response =
      2.0 / std::complex<double>(60.0 - omega * omega, omega * 3.0);
  RunData run;
  run.frequency_hz = 1.0;
  run.amplitude = 2.0;
  run.excitation_error = 1e-3;
  run.harmonics = {1e-5, response.real() + 2e-5, -response.imag() - 1e-5, 2e-5, -3e-5};
  run.harmonic_covariance.assign(25, 0.0);
  for (std::size_t i = 0; i < 5; ++i)
    run.harmonic_covariance[6 * i] = 4e-10;
  run.covariance_degrees = 19.0;
  auto spec = testing::linear_oscillator();
  const Model one(spec);
  spec.effects.insert(spec.effects.begin(), testing::effect("viscous_damping"));
  const Model two(spec);
  Estimator alike(two, {run}, with(Method::lifted)), alone(one, {run}, with(Method::lifted));
  const Fit& fit = alike.fit({1.0, 1.0, 50.0});
  const Fit& reduced = alone.fit({2.0, 50.0});
  EXPECT_EQ(fit.status, FitStatus::undetermined);
  ASSERT_TRUE(fit.determined[2]);
  EXPECT_NEAR(fit.theta[2] / reduced.theta[1], 1.0, 1e-8);
  EXPECT_NEAR(fit.standard_error[2] / reduced.standard_error[1], 1.0, 1e-6);
  EXPECT_NEAR(fit.interval_degrees / reduced.interval_degrees, 1.0, 1e-6);
  EXPECT_NEAR(fit.lack_of_fit, reduced.lack_of_fit, 1e-6);
}

TEST(Estimator, WarnsOfAnAmplitudeThatHardlyDeterminesTheSpring) {
  // Figure 13 at a twentieth of its amplitude, with noise of 1 % of the stroke.
  const Model model(testing::oleo(32.2));
  PeriodicSystem system(model, {Scheme::order6, 400, true});
  system.set_excitation(2.0, 0.5);
  system.solve_from_rest(kOleoFeet);
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = 0.5;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> noise(-0.0057, 0.0057);
  for (int i = 0; i < 40; ++i)
    run.displacement.push_back(system.value(10 * i, 0) + noise(random));
  Estimator estimator(model, {run}, with(Method::lifted));
  estimator.fit(kOleoFeet);
  const Estimate estimate = estimator.describe();
  EXPECT_FALSE(estimate.warnings.empty());
}

TEST(Estimator, RefusesDataThatCannotBeUsedWithTheRunAndTheReason) {
  const Model model(testing::oleo(32.2));
  const auto refusal = [&](RunData run) {
    try {
      Estimator estimator(model, {std::move(run)});
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  RunData run = job1();
  run.frequency_hz = 0.0;
  EXPECT_THAT(refusal(run), HasSubstr("run 1: the frequency"));
  run = job1();
  run.displacement.resize(4);
  EXPECT_THAT(refusal(run), HasSubstr("too few"));
  run = job1();
  run.displacement[3] = std::nan("");
  EXPECT_THAT(refusal(run), HasSubstr("not finite"));
  run = job1();
  run.amplitude = 0.0;
  EXPECT_THAT(refusal(run), HasSubstr("no amplitude"));
  run = job1();
  run.excitation.assign(40, 0.0);  // measured, and nothing moved
  EXPECT_THAT(refusal(run), HasSubstr("no amplitude"));
  EXPECT_THROW(Estimator(model, {}), std::invalid_argument);
  Estimator estimator(model, {job1()});
  run = job1();
  run.periods = 2;
  EXPECT_THROW(estimator.update_run(0, run), std::invalid_argument);
}

TEST(Estimator, RecoversFromAStartBehindTheGasWall) {
  // theta3 = 3: the wall is at 0.33 ft, and the data reach 0.57 ft.
  const Model model(testing::oleo(32.2));
  Estimator estimator(model, {job1()}, with(Method::lifted));
  const Fit& fit = estimator.fit({5.0, 5.0, 3.0, 1.0});
  EXPECT_EQ(fit.status, FitStatus::converged);
}

TEST(Estimator, CoversTheTruthAsOftenAsItsIntervalsSay) {
  // 400 repetitions of job 1 with Gaussian noise; the 95 % intervals have a binomial scatter of
  // 1.1 %.
  const Model model(testing::oleo(32.2));
  PeriodicSystem system(model, {Scheme::order6, 400, true});
  system.set_excitation(2.0, 10.0);
  system.solve_from_rest(kOleoFeet);
  std::mt19937_64 random(8);
  std::normal_distribution<double> noise(0.0, 3e-4);
  RunData run = job1();
  Estimator estimator(model, {run}, with(Method::lifted, 80));
  int inside[4] = {};
  constexpr int kRepetitions = 400;
  for (int repetition = 0; repetition < kRepetitions; ++repetition) {
    for (int i = 0; i < 40; ++i)
      run.displacement[i] = system.value(10 * i, 0) + noise(random);
    estimator.update_run(0, run);
    const Fit& fit = estimator.fit(kOleoFeet);
    for (int k = 0; k < 4; ++k)
      inside[k] += std::fabs(fit.theta[k] - kOleoFeet[k]) < fit.quantile * fit.standard_error[k];
  }
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(inside[k], 0.95 * kRepetitions, 4.5 * 4.36) << k;
}

}  // namespace
}  // namespace shaker::estimator
