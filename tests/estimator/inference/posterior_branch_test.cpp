// When an oscillator has two responses, the posterior is that of the measured one.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <Eigen/Dense>
#include <gmock/gmock.h>

#include "estimator/inference/posterior.hpp"
#include "tests/estimator/fixtures.hpp"
#include "tests/estimator/inference/shooting.hpp"

namespace shaker::estimator {
namespace {

constexpr double kFoldFrequency = 1.2 / (2.0 * std::numbers::pi), kFoldAmplitude = 0.18;
constexpr int kFoldPoints = 48;
constexpr double kFoldNoise = 1e-3;
const std::vector<double> kTruth = {0.05, 1.0, 0.1};  // c, k, k3

struct DuffingRate {
  std::vector<double> theta;
  std::array<double, 2> operator()(const std::array<double, 2>& z, double x) const {
    return {z[1], x - theta[0] * z[1] - theta[1] * z[0] - theta[2] * z[0] * z[0] * z[0]};
  }
};

// Shooting, from the settled motion of the oscillator.
class Branch {
 public:
  explicit Branch(std::array<double, 2> start)
      : table_(testing::excitation_table(kFoldAmplitude, {}, 20 * kFoldPoints)), state_(start) {
    for (int settle = 0; settle < 250; ++settle)
      testing::one_period(DuffingRate{kTruth}, table_, kFoldFrequency, state_, kFoldPoints);
  }

  std::vector<double> at(const std::vector<double>& theta) const {
    auto from = state_;
    return testing::periodic_response(DuffingRate{theta}, table_, kFoldFrequency, from, kFoldPoints)
        .value();
  }

  Eigen::MatrixXd covariance() const {
    return testing::linear_covariance([this](const auto& theta) { return at(theta); }, kTruth,
                                      kFoldNoise);
  }

 private:
  std::vector<double> table_;
  std::array<double, 2> state_;
};

class PosteriorOfABistableOscillator : public ::testing::TestWithParam<bool> {};

TEST_P(PosteriorOfABistableOscillator, IsThatOfTheBranchThatWasMeasured) {
  const bool upper = GetParam();
  const Branch branch(upper ? std::array{2.5, 0.0} : std::array{0.0, 0.0});
  RunData run;
  run.frequency_hz = kFoldFrequency;
  run.amplitude = kFoldAmplitude;
  run.displacement = branch.at(kTruth);
  const double most = *std::max_element(run.displacement.begin(), run.displacement.end());
  ASSERT_EQ(most > 2.0, upper) << "it settled on the other branch";
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, kFoldNoise);
  for (double& u : run.displacement)
    u += normal(random);
  const Model model(testing::duffing());
  EstimationOptions how;
  how.noise = kFoldNoise;
  Estimator estimator(model, {run}, how);
  const Fit fit = estimator.fit(kTruth);
  ASSERT_EQ(fit.status, FitStatus::converged) << fit.trouble;
  const Posterior found = posterior(model, estimator, {run}, how);
  EXPECT_TRUE(found.converged) << found.pareto_k << " " << found.effective_samples;
  ASSERT_EQ(found.parameters.size(), 3U);
  const Eigen::MatrixXd covariance = branch.covariance();
  for (int k = 0; k < 3; ++k) {
    const PosteriorMarginal& p = found.parameters[static_cast<std::size_t>(k)];
    const double sd = std::sqrt(covariance(k, k));
    EXPECT_NEAR(p.standard_deviation / sd, 1.0, 0.1) << k;
    EXPECT_NEAR(p.mean, fit.theta[static_cast<std::size_t>(k)], 0.15 * sd) << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Branches, PosteriorOfABistableOscillator, ::testing::Bool());

}  // namespace
}  // namespace shaker::estimator
