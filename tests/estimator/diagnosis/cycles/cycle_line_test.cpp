#include "estimator/diagnosis/cycles/internal/cycle_line.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace shaker::estimator::diagnosis {
namespace {

// Cycles of 0.5 s whose components scatter by 1e-5, with correlation `rho` between neighbours;
// the mean grows.
Eigen::MatrixXd cycles(int count, double rate, double rho, std::mt19937_64& source) {
  std::normal_distribution<double> normal;
  Eigen::MatrixXd rows(count, 9);
  for (Eigen::Index c = 0; c < rows.cols(); ++c) {
    double noise = normal(source);
    for (Eigen::Index k = 0; k < count; ++k) {
      rows(k, c) = 1e-5 * noise + (c == 0 ? rate * 0.5 * static_cast<double>(k) : 0.0);
      noise = rho * noise + std::sqrt(1.0 - rho * rho) * normal(source);
    }
  }
  return rows;
}

Eigen::VectorXd times(int count) {
  return Eigen::VectorXd::LinSpaced(count, 0.25, 0.25 + 0.5 * (count - 1));
}

// The error of the rate of the mean in standard errors, root mean square over many campaigns.
double spread(double rho) {
  std::mt19937_64 source(17);
  double sum = 0.0, count = 0.0;
  for (int campaign = 0; campaign < 200; ++campaign) {
    const std::vector<Eigen::MatrixXd> runs = {cycles(14, 3e-6, rho, source),
                                               cycles(14, 3e-6, rho, source),
                                               cycles(14, 3e-6, rho, source)};
    for (const CycleLine& line : lines_through(runs, {times(14), times(14), times(14)})) {
      sum += std::pow((line.rate[0] - 3e-6) / line.error[0], 2);
      count += 1.0;
    }
  }
  return std::sqrt(sum / count);
}

// Student's t with 12 degrees of freedom has a standard deviation of 1.10.
TEST(CycleLine, ErrorsAreWhatTheyAreSaidToBe) {
  EXPECT_NEAR(spread(0.0), 1.10, 0.12);
}

TEST(CycleLine, CountsThatNeighboursAreAlike) {
  // Without the correlation it would be 1.1 sqrt(1.6 / 0.4) = 2.2.
  EXPECT_LT(spread(0.6), 1.8);
}

TEST(CycleLine, HarmonicsThatStandStillHaveNoRate) {
  std::mt19937_64 source(5);
  const auto lines = lines_through({cycles(200, 1e-4, 0.0, source)}, {times(200)});
  EXPECT_NEAR(lines[0].rate[0], 1e-4, 5.0 * lines[0].error[0]);
  EXPECT_LT(lines[0].error[0], 1e-7);
  for (Eigen::Index c = 1; c < 9; ++c)
    EXPECT_LT(std::fabs(lines[0].rate[c]), 5.0 * lines[0].error[c]);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
