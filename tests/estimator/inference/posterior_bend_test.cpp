// The quality of the importance weights for a posterior that is known exactly.
#include "estimator/inference/internal/posterior_bend.hpp"

#include <cmath>
#include <numbers>
#include <random>

#include <gmock/gmock.h>

#include "estimator/inference/internal/posterior_importance.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kParameters = 4;
constexpr double kDegrees = 36.0;  // 40 samples minus four parameters

// The covariance of the oleo in units of its own deviations: one long direction, three short
// ones.
MatrixXd scale() {
  MatrixXd mixing(kParameters, kParameters);
  mixing << 1.0, 0.2, 0.1, 0.3,  //
      -0.4, 1.0, 0.3, 0.1,       //
      -0.5, 0.4, 1.0, 0.2,       //
      0.6, -0.3, 0.2, 1.0;
  const VectorXd lengths = VectorXd{{2.0, 0.8, 0.1, 0.02}};
  const VectorXd units = VectorXd{{0.4, 0.06, 0.025, 0.04}};
  return units.asDiagonal() * mixing * lengths.asDiagonal();
}

// The multivariate t of the linear model with unknown noise, (3.27), in z of unit scale.
// `bend`: the shift of z[2] for a unit of z[0].
LogDensity student(double bend) {
  const MatrixXd inverse = scale().inverse();
  return [inverse, bend](std::span<const double> theta) {
    VectorXd z = inverse * Eigen::Map<const VectorXd>(theta.data(), kParameters);
    z[2] -= bend * z[0] * z[0];
    return -0.5 * (kDegrees + kParameters) * std::log1p(z.squaredNorm() / kDegrees);
  };
}

ImportanceSample sampled(double bend, std::uint64_t seed, int rounds = 4) {
  PosteriorOptions options;
  options.seed = seed;
  options.rounds = rounds;
  return sample_by_importance([bend] { return student(bend); }, VectorXd::Zero(kParameters),
                              scale() * scale().transpose(), options);
}

double share(const ImportanceSample& sample) {
  return sample.fewest_effective / static_cast<double>(sample.draws.theta.size());
}

// Every k is below zero: no tail of the proposal is too thin. The loss of effective draws is
// due to tails that are heavier than those of the posterior.
TEST(ProposalOfAPosterior, HasEvenWeightsWhereTheModelIsLinear) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const int rounds : {1, 4}) {
      const ImportanceSample found = sampled(0.0, seed, rounds);
      EXPECT_LT(found.pareto_k, 0.0) << seed << " " << rounds;
      EXPECT_GT(share(found), 0.75) << seed << " " << rounds;
    }
  }
}

// As curved as the oleo's posterior with a weakly nonlinear response: Laplace's approximation
// alone fails.
TEST(ProposalOfAPosterior, FollowsABend) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    ASSERT_LT(share(sampled(1.0, seed, 1)), 0.25) << "the case shows nothing";
    const ImportanceSample found = sampled(1.0, seed);
    EXPECT_LT(found.pareto_k, 0.4) << seed;
    EXPECT_GT(share(found), 0.6) << seed;
    EXPECT_LT(found.followed_k, 0.4) << seed;
    EXPECT_GT(found.followed_share, 0.6) << seed;
    // Moments of Student's t: the mean of z^2, and its variance in the curved direction.
    const double mean = kDegrees / (kDegrees - 2.0);
    const double fourth = 3.0 * mean * kDegrees / (kDegrees - 4.0);
    const double error = std::sqrt((mean + fourth - mean * mean) / found.fewest_effective);
    EXPECT_NEAR((scale().inverse() * found.draws.mean)[2], mean, 4.0 * error) << seed;
  }
}

Draws bent_draws(int count) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  Draws out;
  for (int i = 0; i < count; ++i) {
    VectorXd z(kParameters);
    for (double& value : z)
      value = normal(random);
    z[2] += z[0] * z[0];
    out.theta.push_back(scale() * z);
    out.weight.push_back(1.0);
  }
  weigh(out);
  return out;
}

// The mean, over its own draws, of another density divided by its own is one.
TEST(Bend, KnowsItsDensity) {
  const Bend bend(bent_draws(1000));
  const MatrixXd inverse = scale().inverse();
  const double whole = 4.0 * std::numbers::pi * std::numbers::pi * std::fabs(scale().determinant());
  std::mt19937_64 random(7);
  double sum = 0.0, squares = 0.0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    const VectorXd x = bend.draw(random);
    VectorXd z = inverse * x;
    z[2] -= z[0] * z[0];
    const double ratio = std::exp(-0.5 * z.squaredNorm()) / whole / bend.density(x);
    sum += ratio / kDraws;
    squares += ratio * ratio / kDraws;
  }
  EXPECT_NEAR(sum, 1.0, 4.0 * std::sqrt((squares - sum * sum) / kDraws));
  EXPECT_LT(squares, 1.6) << "it does not follow the bend";
}

TEST(Bend, IsStraightWhereDrawsAreTooFewToSay) {
  const Draws few = bent_draws(8);
  const Bend bend(few);
  const VectorXd off = scale() * VectorXd{{0.5, -0.7, 0.9, 0.4}};
  EXPECT_NEAR(bend.density(few.mean + off) / bend.density(few.mean - off), 1.0, 1e-9);
}

}  // namespace
}  // namespace shaker::estimator
