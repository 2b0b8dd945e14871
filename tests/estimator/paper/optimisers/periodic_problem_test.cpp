#include "estimator/paper/optimisers/periodic_problem.hpp"

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "estimator/paper/figures.hpp"
#include "estimator/paper/optimisers/methods.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::optimisers {
namespace {

// Displacements of the model's solution on a fine Fourier grid, with noise.
RunData measured(const Model& model, const std::vector<double>& theta, double frequency,
                 double amplitude, double noise, unsigned seed = 1) {
  PeriodicSystem system(model, {Scheme::fourier, 200, false});
  system.set_excitation(frequency, amplitude);
  EXPECT_EQ(system.solve_from_rest(theta).status, SolveStatus::converged);
  RunData run;
  run.frequency_hz = frequency;
  run.amplitude = amplitude;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (int i = 0; i < 40; ++i)
    run.displacement.push_back(system.value(5 * i, model.observed()) + noise * normal(random));
  return run;
}

EstimationOptions plain_grid() {
  EstimationOptions options;
  options.grid = {Scheme::order4, 160, false};
  return options;
}

// Compares Q with differences of the gradient, which is an independent calculation.
void expect_curvature(PeriodicProblem& problem, const Eigen::VectorXd& theta, double tolerance) {
  Eigen::MatrixXd q, j;
  Eigen::VectorXd e;
  ASSERT_TRUE(problem.curvature(theta, q));
  ASSERT_TRUE(problem.evaluate(theta, e, &j));
  const Eigen::MatrixXd h = j.transpose() * j + q;
  for (Eigen::Index k = 0; k < theta.size(); ++k) {
    const double step = 1e-5 * theta[k];
    Eigen::VectorXd gradient[2];
    for (int side = 0; side < 2; ++side) {
      Eigen::VectorXd moved = theta;
      moved[k] += side == 0 ? step : -step;
      ASSERT_TRUE(problem.evaluate(moved, e, &j));
      gradient[side] = -j.transpose() * e;
    }
    const Eigen::VectorXd column = (gradient[0] - gradient[1]) / (2.0 * step);
    for (Eigen::Index l = 0; l < theta.size(); ++l) {
      const double size = std::sqrt(std::fabs(h(k, k) * h(l, l)));
      EXPECT_NEAR(column[l] / size, h(l, k) / size, tolerance) << k << "," << l;
    }
  }
}

TEST(PeriodicProblem, HasTheExactHessianOfTheOleo) {
  const Model model(estimator::testing::oleo());
  const auto run = measured(model, estimator::testing::kOleoSi, 2.0, 3.048, 2e-3);
  PeriodicProblem problem(model, {run}, plain_grid());
  expect_curvature(problem, Eigen::Vector4d(18.0, 1.6, 5.2, 1.1), 1e-5);
}

TEST(PeriodicProblem, HasTheExactHessianOfTheOleoOnItsTyre) {
  auto spec = estimator::testing::oleo_on_tyre(0.1);
  const Model model(spec);
  std::vector<double> theta = estimator::testing::kOleoSi;
  theta.push_back(900.0);
  theta.push_back(3.0);
  auto run = measured(model, theta, 2.0, 3.048, 2e-3);
  PeriodicProblem problem(model, {run}, plain_grid());
  Eigen::VectorXd at = problem.reduce(theta);
  ASSERT_EQ(at.size(), model.parameter_count());
  expect_curvature(problem, 1.05 * at, 1e-5);
}

// (6.2), u'' + c u' + k (u) = A cos: the second derivatives of the transfer function in closed
// form.
TEST(PeriodicProblem, HasTheSecondDerivativesOfTheLinearOscillatorInClosedForm) {
  const Model model(estimator::testing::linear_oscillator());
  std::vector<double> theta = model.start();
  int c_at = -1, k_at = -1;
  for (int i = 0; i < model.parameter_count(); ++i) {
    const auto& name = model.parameters()[static_cast<std::size_t>(i)].name;
    if (name == "c") c_at = i;
    if (name == "k") k_at = i;
  }
  ASSERT_GE(c_at, 0);
  ASSERT_GE(k_at, 0);
  theta[static_cast<std::size_t>(c_at)] = 2.0;
  theta[static_cast<std::size_t>(k_at)] = 120.0;
  const double w = 2.0 * std::numbers::pi * 2.0, amplitude = 3.0;
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = amplitude;
  run.displacement.assign(40, 0.0);
  run.displacement[7] = 1.0;  // a spike in e = y - u: Q differs from the sum over u
  EstimationOptions options;
  options.grid = {Scheme::order6, 320, false};
  PeriodicProblem problem(model, {run}, options);
  Eigen::MatrixXd q;
  ASSERT_TRUE(problem.curvature(problem.reduce(theta), q));
  using Complex = std::complex<double>;
  const Complex d = 1.0 / Complex(120.0 - w * w, 2.0 * w);
  const Complex iw(0.0, w);
  const Complex second[3] = {2.0 * iw * iw * d * d * d, 2.0 * iw * d * d * d, 2.0 * d * d * d};
  double expected[3] = {};
  for (int j = 0; j < 40; ++j) {
    const Complex turn = std::polar(amplitude, 2.0 * std::numbers::pi * j / 40.0);
    const double e = run.displacement[static_cast<std::size_t>(j)] - (d * turn).real();
    for (int m = 0; m < 3; ++m)
      expected[m] -= e * (second[m] * turn).real();
  }
  const auto index = [&](int all) {
    std::vector<double> unit(theta.size(), 0.0);
    unit[static_cast<std::size_t>(all)] = 1.0;
    Eigen::Index k = 0;
    problem.reduce(unit).maxCoeff(&k);
    return k;
  };
  const Eigen::Index c = index(c_at), k = index(k_at);
  EXPECT_NEAR(q(c, c) / expected[0], 1.0, 1e-6);
  EXPECT_NEAR(q(c, k) / expected[1], 1.0, 1e-6);
  EXPECT_NEAR(q(k, k) / expected[2], 1.0, 1e-6);
}

TEST(PeriodicProblem, IsSolvedAlikeByEveryMethodFromFivePerCent) {
  const Model model(estimator::testing::oleo());
  const auto run = measured(model, estimator::testing::kOleoSi, 2.0, 3.048, 2e-4);
  EstimationOptions options;
  options.grid = {Scheme::order6, 160, true};
  Estimator estimator(model, {run}, options);
  const Fit& fit = estimator.fit({17.5, 1.6, 5.4, 1.05});
  ASSERT_EQ(fit.status, FitStatus::converged);
  for (const Method& method : methods()) {
    PeriodicProblem problem(model, {run}, options);
    const Summary found = method.minimise(problem, Eigen::Vector4d(17.5, 1.6, 5.4, 1.05), {});
    EXPECT_EQ(found.status, Status::converged) << method.name;
    EXPECT_NEAR(found.sum_of_squares / fit.sum_of_squares, 1.0, 1e-6) << method.name;
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(found.theta[k], fit.theta[static_cast<std::size_t>(k)],
                  0.02 * fit.standard_error[static_cast<std::size_t>(k)])
          << method.name;
    EXPECT_GT(problem.solutions(), 0);
  }
}

}  // namespace
}  // namespace shaker::estimator::optimisers
