// Harmonic balance with few harmonics, compared with independent solutions: the Duffing table,
// the reference solution and sensitivities of the oleo; and with the grid for two masses.
#include "estimator/solve/periodic/internal/harmonic_reduction.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::HasSubstr;

TEST(HarmonicReduction, DuffingAgreesWithTheIndependentTableTo1e8) {
  const Model model(testing::duffing());
  HarmonicReduction reduction(model, {.accuracy = 1e-11});
  reduction.set_excitation(0.8 / (2.0 * std::numbers::pi), 0.18);
  const double theta[] = {0.05, 1.0, 0.1};
  const ReducedSolution found = reduction.solve(theta);
  ASSERT_TRUE(found.sufficient) << found.sentence();
  EXPECT_LE(found.harmonics, 15);
  EXPECT_NEAR(reduction.amplitude(1), 0.4748720473, 1e-8);  // tests/data/duffing.txt
  EXPECT_NEAR(reduction.amplitude(3), 0.0005662678, 1e-8);
}

// Job J4: a Taylor series in extended precision with steps that end where the velocity is 0.
TEST(HarmonicReduction, OleoAgreesWithItsReferenceSolutionAndSensitivities) {
  const auto rows = testing::read_csv("oleo_j4_reference.csv", false);
  ASSERT_EQ(rows.size(), 40u);
  const Model model(testing::oleo(32.2));
  HarmonicReduction reduction(model, {.accuracy = 1e-6});
  reduction.set_excitation(2.0, 10.0);
  const ReducedSolution found = reduction.solve(testing::kOleoFeet);
  ASSERT_TRUE(found.sufficient) << found.sentence();
  double worst = 0.0, worst_sensitivity = 0.0, largest[4] = {};
  for (const auto& row : rows)
    for (int k = 0; k < 4; ++k)
      largest[k] = std::max(largest[k], std::fabs(row[1 + static_cast<std::size_t>(k)]));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double tau = static_cast<double>(i) / 40.0;
    worst = std::max(worst, std::fabs(reduction.value(tau) - rows[i][0]));
    for (int k = 0; k < 4; ++k)
      worst_sensitivity = std::max(
          worst_sensitivity,
          std::fabs(reduction.sensitivity(tau, k) - rows[i][1 + static_cast<std::size_t>(k)]) /
              largest[k]);
  }
  EXPECT_LE(worst, 1e-6 * reduction.amplitude(1)) << found.harmonics;
  EXPECT_LE(worst_sensitivity, 1e-4) << found.harmonics;
}

TEST(HarmonicReduction, SlowForcesNeedFewHarmonicsAndFastCornersAreSaid) {
  const Model model(testing::oleo());
  HarmonicReduction slow(model, {.accuracy = 1e-4});
  slow.set_excitation(0.05, 0.5);
  const ReducedSolution few = slow.solve(testing::kOleoSi);
  ASSERT_TRUE(few.sufficient) << few.sentence();
  EXPECT_LE(few.harmonics, 8);
  PeriodicSystem grid(model, {Scheme::order4, 400});
  grid.set_excitation(0.05, 0.5);
  ASSERT_EQ(grid.solve_from_rest(testing::kOleoSi).status, SolveStatus::converged);
  for (int i = 0; i < 400; i += 10)
    EXPECT_NEAR(slow.value(i / 400.0), grid.value(i, 0), 2e-4 * slow.amplitude(1));

  auto rubbing = testing::oleo();
  rubbing.effects.push_back(testing::effect("coulomb_friction"));
  const Model sharp(rubbing);
  HarmonicReduction corners(sharp, {.most = 7, .accuracy = 1e-9});
  corners.set_excitation(2.0, 3.0);
  auto theta = testing::kOleoSi;
  theta.push_back(0.3);
  const ReducedSolution left = corners.solve(theta);
  EXPECT_FALSE(left.sufficient);
  EXPECT_THAT(left.sentence(), HasSubstr("7 harmonics leave"));
}

TEST(HarmonicReduction, LinearOscillatorIsItsFirstHarmonicExactly) {
  const Model model(testing::linear_oscillator());
  HarmonicReduction reduction(model, {});
  reduction.set_excitation(1.3, 2.0);
  const double c = 1.1, k = 40.0, w = (2.0 * std::numbers::pi) * 1.3, theta[] = {c, k};
  const ReducedSolution found = reduction.solve(theta);
  EXPECT_EQ(found.harmonics, 3);
  EXPECT_NEAR(reduction.amplitude(1), 2.0 / std::hypot(k - w * w, c * w), 1e-14);
  EXPECT_NEAR(reduction.amplitude(2), 0.0, 1e-14);
}

TEST(HarmonicReduction, OleoOnItsTyreAgreesWithTheGrid) {
  const Model model(testing::oleo_on_tyre(0.1));
  auto theta = testing::kOleoSi;
  theta.insert(theta.end(), {400.0, 2.0});
  HarmonicReduction reduction(model, {.accuracy = 1e-5});
  reduction.set_excitation(2.0, 3.0);
  const ReducedSolution found = reduction.solve(theta);
  ASSERT_TRUE(found.sufficient) << found.sentence();
  PeriodicSystem grid(model, {Scheme::order6, 1600});
  grid.set_excitation(2.0, 3.0);
  ASSERT_EQ(grid.solve_from_rest(theta).status, SolveStatus::converged);
  for (int i = 0; i < 1600; i += 50)
    for (int c = 0; c < 2; ++c)
      EXPECT_NEAR(reduction.value(i / 1600.0, c), grid.value(i, c),
                  1e-5 * reduction.amplitude(1, 0));
}

TEST(HarmonicReduction, RefusesOptionsThatCannotBe) {
  const Model model(testing::oleo());
  EXPECT_THROW(HarmonicReduction(model, {.least = 5, .most = 3}), std::invalid_argument);
  EXPECT_THROW(HarmonicReduction(model, {.accuracy = 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace shaker::estimator
