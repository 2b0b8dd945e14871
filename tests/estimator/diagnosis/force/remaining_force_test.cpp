#include "estimator/diagnosis/force/internal/remaining_force.hpp"

#include <cmath>
#include <functional>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"
#include "tests/estimator/diagnosis/campaigns.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// A force over the cells minus the part that a spring and a viscous damper can imitate.
Eigen::VectorXd less_linear(const RemainingForce& force,
                            const std::function<double(double, double)>& truth) {
  const auto n = static_cast<Eigen::Index>(force.cells.size());
  Eigen::MatrixXd columns(n, 2);
  Eigen::VectorXd values(n);
  for (Eigen::Index c = 0; c < n; ++c) {
    const ForceCell& cell = force.cells[static_cast<std::size_t>(c)];
    const double root = std::sqrt(cell.time);
    columns(c, 0) = root * cell.stroke;
    columns(c, 1) = root * cell.velocity;
    values[c] = root * truth(cell.stroke, cell.velocity);
  }
  Eigen::VectorXd left = values - columns * columns.colPivHouseholderQr().solve(values);
  for (Eigen::Index c = 0; c < n; ++c)
    left[c] /= std::sqrt(force.cells[static_cast<std::size_t>(c)].time);
  return left;
}

// The agreement of an estimate with the truth.
struct Met {
  double inside = 0.0;  // fraction of the time within two standard errors
  double correlation = 0.0;
  double size = 0.0;  // of the estimate relative to the truth
};
Met held_against(const RemainingForce& force, const std::function<double(double, double)>& truth) {
  const Eigen::VectorXd expected = less_linear(force, truth);
  Met met;
  double both = 0.0, mine = 0.0, theirs = 0.0;
  for (Eigen::Index c = 0; c < expected.size(); ++c) {
    const ForceCell& cell = force.cells[static_cast<std::size_t>(c)];
    if (std::fabs(cell.force - expected[c]) < 2.0 * cell.standard_error) met.inside += cell.time;
    both += cell.time * cell.force * expected[c];
    mine += cell.time * cell.force * cell.force;
    theirs += cell.time * expected[c] * expected[c];
  }
  met.correlation = both / std::sqrt(mine * theirs);
  met.size = std::sqrt(mine / theirs);
  return met;
}

const std::vector<testing::Setting> kRuns = {{0.8, 1.0}, {1.1, 0.8}, {1.3, 1.0},
                                             {2.2, 1.5}, {2.6, 3.0}, {3.0, 6.0}};

// For the base model alone, without effects of the catalogue. `theta`: receives its estimates.
RemainingForce remaining_of(const Campaign& campaign, std::vector<double>* theta = nullptr) {
  std::vector<SteadyRun> runs;
  for (const Recording& recording : campaign.runs)
    runs.push_back(*steady_cycles(recording));
  auto model = estimator::testing::linear_oscillator();
  model.effects[0].parameters["c"].start = 3.0;
  model.effects[1].parameters["k"].start = 120.0;
  FitOptions options;
  options.from_rest = true;
  HarmonicFit fit = fit_harmonics(model, weigh(runs).data, {}, nullptr, options);
  const Weighed weighed = weigh(runs, fit);
  fit = fit_harmonics(model, weighed.data, fit.theta, nullptr, options);
  EXPECT_TRUE(fit.converged);
  if (theta != nullptr) *theta = fit.theta;
  SeenPriors known;
  const auto found = remaining_force(fit, weighed.data, false, known);
  EXPECT_TRUE(found);
  // The priors that are kept are those of these data.
  const auto again = remaining_force(fit, weighed.data, false, known);
  EXPECT_TRUE(found && again && found->share == again->share);
  return found.value_or(RemainingForce{});
}

TEST(RemainingForce, ShowsAForceOfTheStrokeThatIsInNoCatalogue) {
  const double pitch = 0.03, level = 0.05;
  const auto force = remaining_of(
      testing::recorded({{"detent_force", level}, {"detent_pitch", pitch}}, kRuns, 5, "linear"));
  const Met met = held_against(force, [&](double u, double) {
    return level * std::sin(2.0 * std::numbers::pi * u / pitch);
  });
  EXPECT_GT(met.inside, 0.9);
  EXPECT_GT(met.correlation, 0.98);
  EXPECT_NEAR(met.size, 1.0, 0.1);
  EXPECT_THAT(force.words, ::testing::HasSubstr("remaining force, up to"));
}

// The estimates were moved by the response, not by the force: what is left beside them holds a part
// that the parameters could take.
TEST(RemainingForce, IsAlsoThatBesideTheEstimates) {
  std::vector<double> theta;
  const auto force = remaining_of(
      testing::recorded({{"leaning_friction", 0.5}, {"leaning_middle", 0.0}}, kRuns, 6, "linear"),
      &theta);
  ASSERT_EQ(theta.size(), 2U);
  double inside = 0.0, inside_with_parameters_out = 0.0;
  for (const ForceCell& cell : force.cells) {
    const double u = cell.stroke, v = cell.velocity;
    const double truth =
        0.5 * std::fabs(u) * (v > 0.0 ? 1.0 : -1.0) + (2.0 - theta[0]) * v + (100.0 - theta[1]) * u;
    if (std::fabs(cell.beside - truth) < 2.0 * cell.beside_error) inside += cell.time;
    if (std::fabs(cell.force - truth) < 2.0 * cell.standard_error)
      inside_with_parameters_out += cell.time;
  }
  EXPECT_GT(inside, 0.9);
  EXPECT_LT(inside_with_parameters_out, 0.9);
}

TEST(RemainingForce, ShowsFrictionThatGrowsAwayFromTheMiddle) {
  const auto force = remaining_of(
      testing::recorded({{"leaning_friction", 0.5}, {"leaning_middle", 0.0}}, kRuns, 6, "linear"));
  const Met met = held_against(
      force, [](double u, double v) { return 0.5 * std::fabs(u) * (v > 0.0 ? 1.0 : -1.0); });
  EXPECT_GT(met.inside, 0.9);
  EXPECT_GT(met.correlation, 0.98);
  EXPECT_NEAR(met.size, 1.0, 0.1);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
