// The posterior of figure 13 with all four parameters free, against quadrature over Runge-Kutta
// and shooting in Python (tests/data/posterior/figure13.py), and the proposal that follows a
// valley.
#include "estimator/inference/internal/posterior_valley.hpp"

#include <cmath>

#include <gmock/gmock.h>

#include "estimator/inference/posterior.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

// The columns of figure13_reference.csv, which has a row for each parameter.
enum Column { kMean, kDeviation, kLow, kMedian, kHigh, kDensityLow, kDensityMedian, kDensityHigh };

class FigureThirteen : public ::testing::Test {
 protected:
  FigureThirteen()
      : reference_(testing::read_csv("posterior/figure13_reference.csv")),
        model_(testing::oleo(32.178)) {
    run_.frequency_hz = 2.0;
    run_.amplitude = 5.0;
    for (const auto& row : testing::read_csv("posterior/figure13.csv"))
      run_.displacement.push_back(row[0]);
  }

  Posterior sampled(const PosteriorOptions& options = {}) const {
    Estimator estimator(model_, {run_});
    EXPECT_EQ(estimator.fit(testing::kOleoFeet).status, FitStatus::converged);
    return posterior(model_, estimator, {run_}, {}, options);
  }

  std::vector<std::vector<double>> reference_;
  Model model_;
  RunData run_;
};

// A quantile from draws that count as `effective` independent ones may differ by three of its
// own standard errors.
void expect_quantile(double found, double wanted, double density, double probability,
                     double effective) {
  const double error = std::sqrt(probability * (1.0 - probability) / effective) / density;
  EXPECT_NEAR(found, wanted, 3.0 * error) << probability;
}

TEST_F(FigureThirteen, WithAllParametersFreeAgreesWithQuadrature) {
  const Posterior found = sampled();
  EXPECT_TRUE(found.converged);
  EXPECT_EQ(found.method, PosteriorMethod::ensembles);
  EXPECT_LE(found.r_hat, 1.01);
  EXPECT_LE(found.pareto_k, 0.7);
  ASSERT_EQ(found.parameters.size(), 4U);
  ASSERT_EQ(reference_.size(), 4U);
  for (std::size_t k = 0; k < 4; ++k) {
    SCOPED_TRACE(k);
    const PosteriorMarginal& p = found.parameters[k];
    const std::vector<double>& truth = reference_[k];
    const double n = p.effective_samples;
    EXPECT_GE(n, 400.0);
    EXPECT_NEAR(p.mean, truth[kMean], 3.0 * truth[kDeviation] / std::sqrt(n));
    expect_quantile(p.median, truth[kMedian], truth[kDensityMedian], 0.5, n);
    expect_quantile(p.lower, truth[kLow], truth[kDensityLow], 0.025, n);
    expect_quantile(p.upper, truth[kHigh], truth[kDensityHigh], 0.975, n);
  }
}

TEST_F(FigureThirteen, IsStillRefusedWhereNeitherValleyNorWalkersAreAllowed) {
  PosteriorOptions options;
  options.most_steps = 0;
  EXPECT_FALSE(sampled(options).converged);
}

// After many rounds the weights look good, but the far end of the valley is still missing.
TEST_F(FigureThirteen, IsNotBelievedForTheWeightsOfManyRounds) {
  PosteriorOptions options;
  options.most_steps = 0;
  options.rounds = 8;
  const Posterior found = sampled(options);
  ASSERT_LT(found.pareto_k, 0.4) << "the case shows nothing";
  ASSERT_GT(found.effective_samples, 0.2 * static_cast<double>(found.samples));
  ASSERT_LT(found.parameters[3].standard_deviation, 0.9 * reference_[3][kDeviation]);
  EXPECT_FALSE(found.converged);
}

}  // namespace
}  // namespace shaker::estimator
