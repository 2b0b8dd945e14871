// Response curves through folds: the Duffing oscillator against an independent table, the oleo
// alone and on its tyre, and the linear oscillator against its formula.
#include "estimator/solve/periodic/continuation.hpp"

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::HasSubstr;

const std::vector<double> kDuffing = {0.05, 1.0, 0.1};  // c, k, k3

struct Row {
  bool up;
  double omega, a1, a3;
};

std::vector<Row> duffing_table() {
  std::ifstream file(std::filesystem::path(SHAKER_TEST_DATA) / "duffing.txt");
  std::vector<Row> rows;
  for (std::string line; std::getline(file, line);) {
    char direction[16];
    Row row{};
    int n = 0;
    if (std::sscanf(line.c_str(), "N=%d %15s Om=%lf a1=%lf a3=%lf", &n, direction, &row.omega,
                    &row.a1, &row.a3) != 5 ||
        n != 201)
      continue;
    row.up = std::string(direction) == "up-sweep";
    rows.push_back(row);
  }
  return rows;
}

TEST(Duffing, CurveAgreesWithTheIndependentTableTo1e8) {
  const Model model(testing::duffing());
  Continuation continuation(model, kDuffing);
  const Branch branch = continuation.over_frequency(0.18, 0.5 / (2.0 * std::numbers::pi),
                                                    1.6 / (2.0 * std::numbers::pi));
  EXPECT_TRUE(branch.complete) << branch.ended;
  int compared = 0;
  for (const Row& row : duffing_table()) {
    const auto found = continuation.solutions_at(branch, row.omega / (2.0 * std::numbers::pi));
    if (row.omega > 1.29 && row.omega < 1.31) {
      // Past the fold the table's entry is not a solution of the upper branch.
      ASSERT_EQ(found.size(), 1u);
      EXPECT_GT(std::fabs(std::abs(found[0].harmonics[1]) - row.a1), 3.0);
      continue;
    }
    const bool several = row.omega == 1.2;
    ASSERT_EQ(found.size(), several ? 3u : 1u) << row.omega;
    const BranchPoint& point = row.up ? found.front() : found.back();
    EXPECT_NEAR(std::abs(point.harmonics[1]), row.a1, 1e-8) << row.omega;
    EXPECT_NEAR(std::abs(point.harmonics[3]), row.a3, 1e-8) << row.omega;
    EXPECT_TRUE(point.stable);
    if (several) {
      EXPECT_FALSE(found[1].stable);
    }
    ++compared;
  }
  EXPECT_EQ(compared, 8);
}

TEST(Duffing, HasItsTwoFoldsWhereAMultiplierIsOne) {
  const Model model(testing::duffing());
  Continuation continuation(model, kDuffing);
  const Branch branch = continuation.over_frequency(0.18, 0.5 / (2.0 * std::numbers::pi),
                                                    1.6 / (2.0 * std::numbers::pi));
  ASSERT_EQ(branch.special.size(), 2u);
  for (const SpecialPoint& special : branch.special) {
    EXPECT_EQ(special.kind, Bifurcation::fold);
    EXPECT_NEAR(special.point.floquet.largest(), 1.0, 1e-6);
  }
  const double upper = branch.special[0].point.frequency_hz * (2.0 * std::numbers::pi);
  const double lower = branch.special[1].point.frequency_hz * (2.0 * std::numbers::pi);
  // Harmonic balance with one term, (1 - W^2 + 0.075 a^2)^2 a^2 + (0.1 W a)^2 = 0.18^2, has the
  // folds at 1.2522 and 1.1456; the third harmonic moves them a little.
  EXPECT_NEAR(upper, 1.2666, 0.005);
  EXPECT_NEAR(lower, 1.1156, 0.005);
  EXPECT_LT(upper, 1.30);
  std::size_t unstable = 0;
  for (std::size_t i = 0; i < branch.points.size(); ++i) {
    const bool middle = i > branch.special[0].after && i <= branch.special[1].after;
    EXPECT_EQ(branch.points[i].stable, !middle) << i;
    unstable += middle;
  }
  EXPECT_GT(unstable, 5u);
}

TEST(Duffing, FoldsAreTheSameOverTheAmplitude) {
  const Model model(testing::duffing());
  Continuation continuation(model, kDuffing);
  const Branch over_frequency = continuation.over_frequency(0.18, 0.5 / (2.0 * std::numbers::pi),
                                                            1.6 / (2.0 * std::numbers::pi));
  const double f = over_frequency.special.at(0).point.frequency_hz;
  const Branch over_amplitude = continuation.over_amplitude(f, 0.02, 1.0);
  EXPECT_TRUE(over_amplitude.complete) << over_amplitude.ended;
  ASSERT_EQ(over_amplitude.special.size(), 2u);
  // The upper fold over frequency is the fold at which the upper branch starts over amplitude.
  EXPECT_NEAR(over_amplitude.special[1].point.amplitude, 0.18, 1e-8);
}

TEST(LinearOscillator, FollowsItsFormulaWithoutAnyFold) {
  const Model model(testing::linear_oscillator());
  const double c = 0.8, k = 30.0, a = 2.0;
  Continuation continuation(model, {c, k});
  const Branch branch = continuation.over_frequency(a, 0.3, 2.5);
  EXPECT_TRUE(branch.complete);
  EXPECT_TRUE(branch.special.empty());
  for (const BranchPoint& point : branch.points) {
    const double w = (2.0 * std::numbers::pi) * point.frequency_hz;
    const double expected = a / std::hypot(k - w * w, c * w);
    EXPECT_NEAR(std::abs(point.harmonics[1]), expected, 1e-10 * expected);
    EXPECT_NEAR(point.most, expected, 1e-4 * expected);
    EXPECT_TRUE(point.stable);
  }
}

TEST(Oleo, IsStableAndUniqueOverThePapersAmplitudes) {
  const Model model(testing::oleo(32.178));
  Continuation continuation(model, testing::kOleoFeet, {{Scheme::order6, 160, true}});
  const Branch branch = continuation.over_amplitude(2.0, 1.0, 20.0);
  EXPECT_TRUE(branch.complete) << branch.ended;
  EXPECT_TRUE(branch.special.empty());
  const auto at_10 = continuation.solutions_at(branch, 10.0);
  ASSERT_EQ(at_10.size(), 1u);
  EXPECT_NEAR(at_10[0].floquet.largest(), .33854, 2e-5);
  EXPECT_NEAR(at_10[0].at.z[0], .569755354778, 1e-8);
}

TEST(OleoOnTyre, CurvePassesBothResonancesAndAgreesWithSolutionsFromRest) {
  const Model model(testing::oleo_on_tyre(0.15));
  std::vector<double> theta = testing::kOleoSi;
  theta.insert(theta.end(), {400.0, 1.5});
  Continuation continuation(model, theta, {{Scheme::order4, 128, true}});
  const Branch branch = continuation.over_frequency(1.5, 1.0, 9.0);
  EXPECT_TRUE(branch.complete) << branch.ended;
  for (const double f : {2.0, 5.0, 8.0}) {
    PeriodicSystem system(model, {Scheme::order4, 128, true});
    system.set_excitation(f, 1.5);
    ASSERT_EQ(system.solve_from_rest(theta).status, SolveStatus::converged);
    const auto found = continuation.solutions_at(branch, f);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_TRUE(found[0].stable);
    EXPECT_EQ(found[0].floquet.multipliers.size(), 4u);
    for (std::size_t k = 0; k < found[0].at.z.size(); ++k)
      EXPECT_NEAR(found[0].at.z[k], system.state()[k], 1e-8);
  }
}

// A softening spring that just carries its load. A stronger excitation pulls the mass over the
// barrier, and no periodic motion is connected to the rest position.
config::ModelSpec loaded_softening_spring() {
  config::ModelSpec spec = testing::duffing();
  spec.effects.push_back(testing::effect("gravity"));
  spec.gravity = 0.3;
  return spec;
}

TEST(NoSolution, SaysHowFarTheAmplitudeGot) {
  const Model model(loaded_softening_spring());
  const std::vector<double> softening = {0.2, 1.0, -1.0};
  Continuation continuation(model, softening);
  const Branch branch = continuation.over_amplitude(0.2 / (2.0 * std::numbers::pi), 0.002, 0.5);
  EXPECT_FALSE(branch.complete);
  EXPECT_THAT(branch.ended, HasSubstr("came back"));
  ASSERT_FALSE(branch.special.empty());
  EXPECT_EQ(branch.special[0].kind, Bifurcation::fold);
  double reached = 0.0;
  for (const SpecialPoint& special : branch.special)
    reached = std::max(reached, special.point.amplitude);
  PeriodicSystem system(model, {Scheme::order6, 256, true});
  system.set_excitation(0.2 / (2.0 * std::numbers::pi), 0.5);
  const SolveReport report = solve_through_folds(system, softening);
  EXPECT_EQ(report.status, SolveStatus::no_convergence);
  EXPECT_NEAR(report.amplitude_reached * 0.5, reached, 0.02 * reached);
  EXPECT_THAT(report.sentence(), HasSubstr("turn back"));
  EXPECT_NEAR(system.excitation()[0], 0.5, 1e-15);  // the excitation is the caller's again
}

TEST(ThroughFolds, FindsTheSolutionBeyondThemThatStepsInAmplitudeMiss) {
  const Model model(testing::duffing());
  PeriodicSystem system(model, {Scheme::order6, 256, true});
  system.set_excitation(1.2 / (2.0 * std::numbers::pi), 0.4);
  const SolveReport report = solve_through_folds(system, kDuffing);
  EXPECT_EQ(report.status, SolveStatus::converged) << report.sentence();
  EXPECT_LT(system.residual(), 1e-8);
}

TEST(Continuation, SaysThatThereIsNoStart) {
  const Model model(loaded_softening_spring());
  Continuation continuation(model, {0.2, 1.0, -1.0});
  const Branch branch = continuation.over_frequency(0.5, 0.2 / (2.0 * std::numbers::pi),
                                                    0.3 / (2.0 * std::numbers::pi));
  EXPECT_TRUE(branch.points.empty());
  EXPECT_THAT(branch.ended, HasSubstr("no start"));
  EXPECT_THAT(branch.ended, HasSubstr("%"));
}

}  // namespace
}  // namespace shaker::estimator
