#include "estimator/math/harmonic_basis.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

TEST(HarmonicBasis, TermsAreCosinesAndSinesInTurn) {
  std::vector<double> row(5);
  fill_harmonic_row(0.1, row);
  const double angle = 0.2 * std::numbers::pi;
  const double expected[] = {1.0, std::cos(angle), std::sin(angle), std::cos(2.0 * angle),
                             std::sin(2.0 * angle)};
  for (int k = 0; k < 5; ++k) {
    EXPECT_NEAR(row[static_cast<std::size_t>(k)], expected[k], 1e-15);
    EXPECT_NEAR(harmonic_term(k, 3, 30), expected[k], 1e-15);
    // Whole periods later it is the same to the last digit.
    EXPECT_EQ(harmonic_term(k, 3 + 30 * 7, 30), harmonic_term(k, 3, 30));
  }
}

// 24 harmonics, each turned from the one before, at phases before, in and after the first period.
TEST(HarmonicBasis, HighHarmonicsAreExactToRounding) {
  std::vector<double> row(49);
  for (const double tau : {-1.3, 0.0, 0.1234, 0.5, 0.987, 41.37}) {
    fill_harmonic_row(tau, row);
    for (std::size_t h = 1; h <= 24; ++h) {
      const double angle =
          2.0 * std::numbers::pi * static_cast<double>(h) * std::remainder(tau, 1.0);
      EXPECT_NEAR(row[2 * h - 1], std::cos(angle), 1e-12) << tau << " " << h;
      EXPECT_NEAR(row[2 * h], std::sin(angle), 1e-12) << tau << " " << h;
    }
  }
}

TEST(HarmonicBasis, AFourierSumFindsItsHarmonic) {
  std::vector<double> y;
  for (int i = 0; i < 40; ++i)
    y.push_back(0.7 * harmonic_term(5, i, 40) - 0.2 * harmonic_term(6, i, 40));
  const std::complex<double> third = fourier_sum(y, 3, 2.0 / 40.0);
  EXPECT_NEAR(third.real(), 0.7, 1e-14);
  EXPECT_NEAR(third.imag(), 0.2, 1e-14);
  EXPECT_NEAR(std::abs(fourier_sum(y, 2)), 0.0, 1e-13);
}

}  // namespace
}  // namespace shaker::estimator
