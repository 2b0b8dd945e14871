#include "estimator/inference/internal/posterior_convergence.hpp"

#include <random>

#include <gmock/gmock.h>

namespace shaker::estimator {
namespace {

using Chains = std::vector<std::vector<double>>;

// x_t = phi x_(t-1) + e, with variance 1, plus an offset and a scale for each chain.
Chains chains_of(double phi, const std::vector<double>& offset, const std::vector<double>& scale,
                 int length = 5000) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  Chains out;
  for (std::size_t c = 0; c < offset.size(); ++c) {
    out.emplace_back();
    double x = normal(random);
    for (int t = 0; t < length; ++t) {
      x = phi * x + std::sqrt(1.0 - phi * phi) * normal(random);
      out.back().push_back(offset[c] + scale[c] * x);
    }
  }
  return out;
}

TEST(PosteriorConvergence, IsReachedByIndependentDraws) {
  EXPECT_LT(split_r_hat(chains_of(0.0, {0, 0, 0, 0}, {1, 1, 1, 1})), 1.002);
}

TEST(PosteriorConvergence, IsMissedWhereOneChainIsElsewhereWiderOrDrifts) {
  EXPECT_GT(split_r_hat(chains_of(0.0, {0, 0, 0, 0.5}, {1, 1, 1, 1})), 1.02);
  EXPECT_GT(split_r_hat(chains_of(0.0, {0, 0, 0, 0}, {1, 1, 1, 2})), 1.02);
  Chains drifting = chains_of(0.0, {0, 0, 0, 0}, {1, 1, 1, 1});
  for (auto& chain : drifting) {
    for (std::size_t t = 0; t < chain.size(); ++t)
      chain[t] += static_cast<double>(t) / static_cast<double>(chain.size());
  }
  EXPECT_GT(split_r_hat(drifting), 1.02);
  EXPECT_EQ(split_r_hat({{1, 1, 1, 1}, {1, 1, 1, 1}}), std::numeric_limits<double>::infinity());
}

// Draws of an autoregression count as (1 - phi) / (1 + phi) times as many independent draws.
TEST(PosteriorConvergence, KnowsWhatDrawsOfAnAutoregressionAreWorth) {
  for (const double phi : {0.0, 0.5, 0.9}) {
    const double expected = 20000.0 * (1.0 - phi) / (1.0 + phi);
    EXPECT_NEAR(effective_of_chains(chains_of(phi, {0, 0, 0, 0}, {1, 1, 1, 1}), 1.0) / expected,
                1.0, 0.2)
        << phi;
  }
}

}  // namespace
}  // namespace shaker::estimator
