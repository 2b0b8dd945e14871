// Posteriors of the paper's systems, and of shapes that a proposal cannot follow, against other
// code: quadrature, Runge-Kutta and shooting, a Taylor series in extended precision.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "estimator/inference/posterior.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/estimator/inference/shooting.hpp"

namespace shaker::estimator {
namespace {

constexpr double kNowhere = -std::numeric_limits<double>::infinity();

// y1 ~ N(0, 10^2), y2 ~ N(0, 1), x1 = y1, x2 = y2 + 0.05 y1^2 (curved), x3 ~ N(0, 1). The mode
// is (0, 0, 0); the moments of x2 are those of 5 chi^2 + N(0, 1).
double banana(std::span<const double> x) {
  const double y2 = x[1] - 0.05 * x[0] * x[0];
  return -0.5 * (x[0] * x[0] / 100.0 + y2 * y2 + x[2] * x[2]);
}

// P(x2 < at), by Simpson's rule over y1 = 10 z.
double banana_below(double at) {
  constexpr int kSteps = 4000;
  double sum = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    const double z = -8.0 + 16.0 * i / kSteps;
    const double weight = i == 0 || i == kSteps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    sum += weight * std::exp(-0.5 * z * z) * 0.5 * std::erfc((5.0 * z * z - at) / M_SQRT2);
  }
  return sum * 16.0 / kSteps / 3.0 / std::sqrt(2.0 * std::numbers::pi);
}

double banana_quantile(double probability) {
  double low = -10.0, high = 500.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (banana_below(middle) < probability ? low : high) = middle;
  }
  return low;
}

TEST(PosteriorOfABanana, IsFoundByWalkersWhereItsProposalFails) {
  PosteriorOptions poor;
  poor.samples = poor.most_samples = 500;
  poor.rounds = 1;
  const auto make = []() -> LogDensity { return banana; };
  const std::vector<double> mode = {0.0, 0.0, 0.0}, peak = {100, 0, 0, 0, 1, 0, 0, 0, 1};
  poor.most_steps = 0;
  const Posterior alone = sample_posterior(make, mode, peak, poor);
  ASSERT_FALSE(alone.converged) << "the case shows nothing";
  EXPECT_EQ(alone.method, PosteriorMethod::importance);
  poor.most_steps = PosteriorOptions{}.most_steps;
  const Posterior found = sample_posterior(make, mode, peak, poor);
  EXPECT_EQ(found.method, PosteriorMethod::ensembles);
  EXPECT_TRUE(found.converged) << found.r_hat << " " << found.effective_samples;
  EXPECT_LE(found.r_hat, 1.01);
  EXPECT_GE(found.effective_samples, 400.0);
  const double mean[] = {0.0, 5.0, 0.0}, variance[] = {100.0, 51.0, 1.0};
  for (std::size_t k = 0; k < 3; ++k) {
    const PosteriorMarginal& p = found.parameters[k];
    const double sd = std::sqrt(variance[k]);
    EXPECT_NEAR(p.mean, mean[k], 4.0 * sd / std::sqrt(p.effective_samples)) << k;
    EXPECT_NEAR(p.standard_deviation / sd, 1.0, 0.15) << k;
    EXPECT_EQ(p.mode, 0.0);
  }
  const PosteriorMarginal& bent = found.parameters[1];
  EXPECT_NEAR(bent.median, banana_quantile(0.5), 0.15 * std::sqrt(51.0));
  EXPECT_NEAR(bent.lower, banana_quantile(0.025), 0.1 * std::sqrt(51.0));
  EXPECT_NEAR(bent.upper / banana_quantile(0.975), 1.0, 0.15);
  // The result does not depend on the number of threads.
  poor.threads = 3;
  const Posterior again = sample_posterior(make, mode, peak, poor);
  EXPECT_EQ(again.parameters[1].mean, bent.mean);
  EXPECT_EQ(again.samples, found.samples);
}

TEST(PosteriorOfABanana, DrawsUntilItsMeansAreWorthEnough) {
  PosteriorOptions few;
  few.samples = 200;
  few.most_steps = 0;
  const auto make = []() -> LogDensity {
    return [](std::span<const double> x) { return -0.5 * (x[0] * x[0] + x[1] * x[1]); };
  };
  const Posterior found = sample_posterior(make, {0.0, 0.0}, {1, 0, 0, 1}, few);
  EXPECT_TRUE(found.converged);
  EXPECT_GT(found.samples, 200);
  for (const PosteriorMarginal& p : found.parameters)
    EXPECT_GE(p.effective_samples, few.fewest_effective);
}

// The noise is so small that the oleo is linear in its parameters: Student's t around the
// optimum of the reference, with its covariance. With s^2 integrated out, 40 - 4 degrees of
// freedom are left.
TEST(PosteriorOfTheOleo, IsStudentsTAroundTheReference) {
  const Model model(testing::oleo(32.2));
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = 10.0;
  for (const auto& row : testing::read_csv("oleo_j1.csv"))
    run.displacement.push_back(row[1]);
  const auto reference = testing::read_csv("oleo_j1_reference.csv", false);
  const std::vector<double>&theta = reference[0], &covariance = reference[2];
  ASSERT_EQ(theta.size(), 4U);
  ASSERT_EQ(covariance.size(), 16U);
  Estimator estimator(model, {run});
  ASSERT_EQ(estimator.fit(testing::kOleoFeet).status, FitStatus::converged);
  const Posterior found = posterior(model, estimator, {run}, {});
  EXPECT_TRUE(found.converged);
  for (std::size_t k = 0; k < 4; ++k) {
    const PosteriorMarginal& p = found.parameters[k];
    const double error = std::sqrt(covariance[5 * k]);
    EXPECT_NEAR(p.mode, theta[k], 1e-3 * error) << k;
    EXPECT_NEAR(p.mean, theta[k], 0.12 * error) << k;
    EXPECT_NEAR(p.median, theta[k], 0.12 * error) << k;
    EXPECT_NEAR(p.standard_deviation / (error * std::sqrt(36.0 / 34.0)), 1.0, 0.06) << k;
    EXPECT_NEAR((p.upper - p.lower) / (2.0 * 2.0281 * error), 1.0, 0.08) << k;
  }
}

// u is the stroke, d the tyre's deflection. The unsprung mass is a tenth; k and c are per
// sprung mass.
struct TyreInTime {
  std::vector<double> theta;
  std::array<double, 4> operator()(const std::array<double, 4>& z, double x) const {
    const testing::OleoInTime strut{theta};
    const double f = 9.80665 - strut({z[0], z[1]}, 0.0)[1];  // force of the oleo without gravity
    const double tyre = (f - theta[4] * z[2] - theta[5] * z[3]) / 0.1 + 9.80665 + x;
    return {z[1], x + 9.80665 - f - tyre, z[3], tyre};
  }
  std::array<double, 4> rest() const {
    const auto strut = testing::OleoInTime{theta}.rest();
    return {strut[0], 0.0, 9.80665 * 1.1 / theta[4], 0.0};
  }
};

// The known noise is so small that the system is linear in theta: (J^T J)^-1, with J from
// differences of shooting.
TEST(PosteriorOfTheOleoOnItsTyre, HasTheCovarianceOfShooting) {
  constexpr double kNoise = 1e-6;
  constexpr int kPoints = 40;
  std::vector<double> truth = testing::kOleoSi;
  truth.insert(truth.end(), {900.0, 3.0});
  const auto table = testing::excitation_table(3.048, {}, 1600);
  TyreInTime exact{truth};
  auto state = exact.rest();
  for (int settle = 0; settle < 20; ++settle)
    testing::one_period(exact, table, 2.0, state, kPoints);
  const auto at = [&](const std::vector<double>& theta) {
    auto from = state;
    return testing::periodic_response(TyreInTime{theta}, table, 2.0, from, kPoints).value();
  };
  const Eigen::MatrixXd covariance = testing::linear_covariance(at, truth, kNoise);
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = 3.048;
  run.displacement = at(truth);
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal(0.0, kNoise);
  for (double& u : run.displacement)
    u += normal(random);
  const Model model(testing::oleo_on_tyre(0.1));
  EstimationOptions how;
  how.noise = kNoise;
  Estimator estimator(model, {run}, how);
  const Fit& fit = estimator.fit(truth);
  ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  PosteriorOptions few;
  few.samples = 1500;
  few.rounds = 2;
  const Posterior found = posterior(model, estimator, {run}, how, few);
  EXPECT_TRUE(found.converged) << found.pareto_k << " " << found.effective_samples;
  for (int k = 0; k < 6; ++k) {
    const PosteriorMarginal& p = found.parameters[static_cast<std::size_t>(k)];
    const double sd = std::sqrt(covariance(k, k));
    EXPECT_NEAR(p.standard_deviation / sd, 1.0, 0.12) << k;
    EXPECT_NEAR(p.mean, fit.theta[static_cast<std::size_t>(k)],
                4.0 * sd / std::sqrt(p.effective_samples))
        << k;
  }
}

// Figure 13 with known theta1 and theta2, so that theta3 and theta4 can be integrated over.
// Each density comes from Runge-Kutta and shooting.
class BentValley {
 public:
  BentValley() : table_(testing::excitation_table(5.0, {}, 200)) {
    const testing::OleoInTime exact{testing::kOleoFeet, 32.178};
    state_ = exact.rest();
    for (int settle = 0; settle < 20; ++settle)
      testing::one_period(exact, table_, 2.0, state_, 40);
    y_ = testing::periodic_response(exact, table_, 2.0, state_, 40).value();
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> noise(-0.0055, 0.0055);
    for (double& u : y_)
      u += noise(random);
  }
  const std::vector<double>& measured() const { return y_; }

  double log_density(double theta3, double theta4) {
    const testing::OleoInTime oleo{{5.08, 5.0, theta3, theta4}, 32.178};
    auto state = state_;
    const auto u = testing::periodic_response(oleo, table_, 2.0, state, 40);
    if (!u) return kNowhere;
    double sum = 0.0;
    for (std::size_t i = 0; i < u->size(); ++i)
      sum += (y_[i] - (*u)[i]) * (y_[i] - (*u)[i]);
    return std::isfinite(sum) ? -20.0 * std::log(sum) : kNowhere;
  }

  // The best theta3 for a given theta4, by golden section.
  double ridge(double theta4) {
    constexpr double kGolden = 0.6180339887498949;
    double low = 0.3, high = 6.0;
    // A much too stiff gas has no solution; along the ridge theta3 theta4 is nearly constant.
    low = std::max(low, 0.4 * 1.62 / theta4);
    high = std::min(high, 1.8 * 1.62 / theta4);
    double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    double fa = log_density(a, theta4), fb = log_density(b, theta4);
    for (int i = 0; i < 25; ++i) {
      if (fa > fb) {
        high = b, b = a, fb = fa;
        fa = log_density(a = high - kGolden * (high - low), theta4);
      } else {
        low = a, a = b, fa = fb;
        fb = log_density(b = low + kGolden * (high - low), theta4);
      }
    }
    return 0.5 * (low + high);
  }

 private:
  std::vector<double> table_, y_;
  std::array<double, 2> state_{};
};

struct Marginal {
  std::vector<double> at, weight;
  double mean = 0.0, deviation = 0.0;
  void finish() {
    double whole = 0.0, square = 0.0;
    for (const double w : weight)
      whole += w;
    for (std::size_t i = 0; i < at.size(); ++i)
      mean += weight[i] / whole * at[i];
    for (std::size_t i = 0; i < at.size(); ++i)
      square += weight[i] / whole * (at[i] - mean) * (at[i] - mean);
    deviation = std::sqrt(square);
    for (double& w : weight)
      w /= whole;
  }
  // Nodes are at the middle of the steps.
  double quantile(double probability, double step) const {
    double below = 0.0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      if (below + weight[i] >= probability)
        return at[i] + step * ((probability - below) / weight[i] - 0.5);
      below += weight[i];
    }
    return at.back();
  }
};

struct Quadrature {
  static constexpr double kFrom = 0.95, kTo = 1.05, kStep = 0.002;  // of theta4
  static constexpr int kAcross = 12;  // nodes to each side of the ridge
  Marginal third, fourth;
  std::vector<double> along;  // log density of the ridge

  void integrate(BentValley& valley) {
    const double top = valley.log_density(valley.ridge(1.0), 1.0);
    for (double theta4 = kFrom + 0.5 * kStep; theta4 < kTo; theta4 += kStep) {
      const double best = valley.ridge(theta4);
      const double log = valley.log_density(best, theta4);
      if (!(log > top - 20.0)) continue;
      const double h = 2e-3 * best;
      const double bend = (2.0 * log - valley.log_density(best + h, theta4) -
                           valley.log_density(best - h, theta4)) /
                          (h * h);
      ASSERT_GT(bend, 0.0) << theta4;
      const double across = 6.0 / std::sqrt(bend) / kAcross;
      double sum = 0.0;
      for (int i = -kAcross; i <= kAcross; ++i) {
        const double theta3 = best + across * i;
        const double w = across * std::exp(valley.log_density(theta3, theta4) - top);
        sum += w;
        third.at.push_back(theta3);
        third.weight.push_back(w);
      }
      fourth.at.push_back(theta4);
      fourth.weight.push_back(sum);
      along.push_back(log);
    }
    third.finish();
    fourth.finish();
  }
};

// The oleo of figure 13: theta1 and theta2 are known.
config::ModelSpec with_two_unknown() {
  auto spec = testing::oleo(32.178);
  for (auto& [name, value] : {std::pair{"theta1", 5.08}, {"theta2", 5.0}}) {
    auto& parameter = spec.effects[std::string(name) == "theta1" ? 0 : 1].parameters[name];
    parameter.start = value;
    parameter.fixed = true;
  }
  spec.effects[1].parameters["theta4"].start = 1.0;
  spec.effects[1].parameters["theta4"].lower = Quadrature::kFrom;
  spec.effects[1].parameters["theta4"].upper = Quadrature::kTo;
  return spec;
}

TEST(PosteriorOfFigure13, AgreesWithQuadrature) {
  BentValley valley;
  Quadrature quadrature;
  ASSERT_NO_FATAL_FAILURE(quadrature.integrate(valley));
  const auto& [third, fourth, along] = quadrature;
  const Model model(with_two_unknown());
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = 5.0;
  run.displacement = valley.measured();
  Estimator estimator(model, {run});
  ASSERT_EQ(estimator.fit(testing::kOleoFeet).status, FitStatus::converged);
  const Posterior found = posterior(model, estimator, {run}, {});
  EXPECT_TRUE(found.converged) << found.pareto_k << " " << found.effective_samples;
  const PosteriorMarginal &p3 = found.parameters[0], &p4 = found.parameters[1];
  ASSERT_GT(fourth.at.size(), 15U);
  EXPECT_NEAR(p3.mean, third.mean, 0.1 * third.deviation);
  EXPECT_NEAR(p4.mean, fourth.mean, 0.1 * fourth.deviation);
  EXPECT_NEAR(p3.standard_deviation / third.deviation, 1.0, 0.1);
  EXPECT_NEAR(p4.standard_deviation / fourth.deviation, 1.0, 0.1);
  EXPECT_NEAR(p4.median, fourth.quantile(0.5, Quadrature::kStep), 0.1 * fourth.deviation);
  EXPECT_NEAR(p4.lower, fourth.quantile(0.025, Quadrature::kStep), 0.1 * fourth.deviation);
  EXPECT_NEAR(p4.upper, fourth.quantile(0.975, Quadrature::kStep), 0.25 * fourth.deviation);
  // At the mode the density is largest (2.13).
  const double at_mode = valley.log_density(p3.mode, p4.mode);
  EXPECT_LE(*std::max_element(along.begin(), along.end()), at_mode + 1e-3);
}

}  // namespace
}  // namespace shaker::estimator
