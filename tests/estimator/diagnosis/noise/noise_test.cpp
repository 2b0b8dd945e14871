#include "estimator/diagnosis/noise/internal/noise.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

Scatter scatter(std::mt19937_64& source, double frequency, int cycles, int harmonics, double colour,
                double memory) {
  std::normal_distribution<double> normal;
  Scatter s{frequency, Eigen::MatrixXd(cycles, 1 + 2 * harmonics)};
  for (Eigen::Index c = 0; c < s.cycles.cols(); ++c) {
    const auto h = static_cast<double>((c + 1) / 2);
    const double size = std::pow(std::max(1.0, h), -colour);
    double last = normal(source);
    for (Eigen::Index k = 0; k < cycles; ++k) {
      last = memory * last + std::sqrt(1.0 - memory * memory) * normal(source);
      s.cycles(k, c) = size * last;
    }
  }
  return s;
}

TEST(CampaignNoise, PoolsWhatIsAlike) {
  std::mt19937_64 source(1);
  std::vector<Scatter> runs;
  for (int r = 0; r < 6; ++r)
    runs.push_back(scatter(source, 1.0 + r, 10, 10, 0.0, 0.0));
  const CampaignNoise noise = campaign_noise(runs);
  for (const RunNoise& run : noise.runs) {
    for (Eigen::Index c = 1; c < run.variance.size(); ++c)
      EXPECT_NEAR(run.variance[c], 0.1, 0.04);
    EXPECT_GT(run.freedom[5], 60.0);
  }
}

TEST(CampaignNoise, FollowsTheColour) {
  std::mt19937_64 source(2);
  std::vector<Scatter> runs;
  for (int r = 0; r < 6; ++r)
    runs.push_back(scatter(source, 1.0 + r, 12, 10, 1.0, 0.0));
  const CampaignNoise noise = campaign_noise(runs);
  for (const RunNoise& run : noise.runs)
    EXPECT_NEAR(std::log(run.variance[1] / run.variance[19]), 2.0 * std::log(10.0), 1.5);
}

// Slow noise makes the error of the mean larger than scatter / cycles: the stated error must
// hold.
TEST(CampaignNoise, CountsWhatCarriesOverFromCycleToCycle) {
  std::mt19937_64 source(3);
  double claimed = 0.0, seen = 0.0;
  for (int repetition = 0; repetition < 60; ++repetition) {
    std::vector<Scatter> runs;
    for (int r = 0; r < 4; ++r)
      runs.push_back(scatter(source, 1.0 + r, 16, 8, 0.0, 0.6));
    const CampaignNoise noise = campaign_noise(runs);
    for (std::size_t r = 0; r < runs.size(); ++r) {
      claimed += noise.runs[r].variance.tail(16).mean();
      seen += runs[r].cycles.rightCols(16).colwise().mean().cwiseAbs2().mean();
    }
  }
  EXPECT_GT(claimed / seen, 0.6);
  EXPECT_LT(claimed / seen, 1.5);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
