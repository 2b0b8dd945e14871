// Responses over two and three periods of the oleo, alone and on its tyre, against
// tests/data/multi_period: extrapolated midpoint steps and shooting in Python.
#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <fstream>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "estimator/fit/estimation.hpp"
#include "estimator/math/numbers.hpp"
#include "estimator/solve/periodic/continuation.hpp"
#include "estimator/solve/periodic/multi_period.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

const std::vector<double> kLinear = {2.0, 120.0};  // c, k
constexpr int kSamples = 48;                       // in a period of the reference
constexpr int kPoints = 240;                       // in a period of the grid

const nlohmann::json& reference() {
  static const nlohmann::json all = nlohmann::json::parse(
      std::ifstream(std::filesystem::path(SHAKER_TEST_DATA) / "multi_period/reference.json"));
  return all;
}

struct Case {
  const char* name;
  bool tyre;
  double state_error, multiplier_error;
  double off;  // relative error of the start of a fit

  config::ModelSpec spec() const { return tyre ? testing::oleo_on_tyre(0.1) : testing::oleo(); }
  const nlohmann::json& known() const { return reference().at(name); }
  std::vector<double> numbers(const char* what) const {
    return known().at(what).get<std::vector<double>>();
  }
  std::vector<double> theta() const { return numbers("theta"); }
  int periods() const { return known().at("periods"); }
  double frequency() const { return known().at("frequency"); }
  double amplitude() const { return known().at("amplitude"); }
};
void PrintTo(const Case& one, std::ostream* out) {
  *out << one.name;
}

// Solves over all periods from the stroke alone; the tyre starts at the response of one period.
SolveReport solve_from_stroke(const Case& one, PeriodicSystem& system) {
  set_excitation_over(system, one.periods(), one.frequency(), one.amplitude());
  system.solve_from_rest(one.theta());
  start_from_record(system, one.numbers("stroke"), 6 * one.periods());
  return system.solve(one.theta());
}

// The largest difference from the reference, when that starts `shift` periods later.
double apart(const Case& one, const PeriodicSystem& system, int shift = 0) {
  const std::vector<double> stroke = one.numbers("stroke");
  const int count = static_cast<int>(stroke.size()), every = system.points() / count;
  double most = 0.0;
  for (int j = 0; j < count; ++j)
    most =
        std::max(most, std::fabs(system.value(j * every, 0) -
                                 stroke[static_cast<std::size_t>((j + shift * kSamples) % count)]));
  return most;
}

class OverPeriods : public ::testing::TestWithParam<Case> {
 protected:
  Model model{GetParam().spec()};
  GridOptions ring{Scheme::order6, kPoints* GetParam().periods(), true};
};

TEST_P(OverPeriods, SolutionIsTheReferences) {
  const Case& one = GetParam();
  PeriodicSystem system(model, ring);
  ASSERT_EQ(solve_from_stroke(one, system).status, SolveStatus::converged);
  EXPECT_LT(apart(one, system), one.state_error);
  EXPECT_GT(subharmonic_share(system, one.periods()), 0.05);
  if (one.tyre) {
    const std::vector<double> tyre = one.numbers("tyre");
    for (std::size_t j = 0; j < tyre.size(); ++j)
      EXPECT_NEAR(system.value(static_cast<int>(j) * kPoints / kSamples, 1), tyre[j],
                  one.state_error);
  }
}

TEST_P(OverPeriods, MultipliersAreThoseOfThePeriodMap) {
  const Case& one = GetParam();
  PeriodicSystem system(model, ring);
  ASSERT_EQ(solve_from_stroke(one, system).status, SolveStatus::converged);
  const auto stability = floquet(system, one.theta());
  ASSERT_TRUE(stability.ok());
  EXPECT_TRUE(stability->stable());
  const auto& known = one.known().at("multipliers");
  ASSERT_EQ(stability->multipliers.size(), known.size());
  for (std::size_t k = 0; k < known.size(); ++k) {
    const std::complex<double> expected(known[k][0], known[k][1]);
    EXPECT_LT(std::abs(stability->multipliers[k] - expected), one.multiplier_error) << k;
  }
}

TEST_P(OverPeriods, ResponseReachedFromRestIsStillTheOneOfOnePeriod) {
  const Case& one = GetParam();
  PeriodicSystem system(model, ring);
  set_excitation_over(system, one.periods(), one.frequency(), one.amplitude());
  ASSERT_EQ(system.solve_from_rest(one.theta()).status, SolveStatus::converged);
  EXPECT_LT(subharmonic_share(system, one.periods()), 1e-8);
}

RunData noisy_record(const Case& one, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0.0, 2e-4);
  RunData run;
  run.frequency_hz = one.frequency();
  run.amplitude = one.amplitude();
  run.periods = one.periods();
  for (const double u : one.numbers("stroke"))
    run.displacement.push_back(u + noise(random));
  return run;
}

TEST_P(OverPeriods, NoisyRecordsGiveTheTruthWithinTheirIntervals) {
  const Case& one = GetParam();
  const std::vector<double> truth = one.theta();
  std::vector<double> start = truth;
  for (std::size_t k = 0; k < start.size(); ++k)
    start[k] *= k % 2 == 0 ? 1.0 + one.off : 1.0 - 0.6 * one.off;
  EstimationOptions options;
  options.grid.points = kPoints;
  const int records = one.tyre ? 25 : 50;
  int within = 0;
  double square = 0.0;
  std::mt19937_64 random(5);
  for (int record = 0; record < records; ++record) {
    Estimator estimator(model, {noisy_record(one, random)}, options);
    const Fit& fit = estimator.fit(start);
    ASSERT_EQ(fit.status, FitStatus::converged) << record << ": " << fit.trouble;
    EXPECT_GT(subharmonic_share(estimator.solutions()[0], one.periods()), 0.05) << record;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const double off = std::fabs(fit.theta[k] - truth[k]) / fit.standard_error[k];
      EXPECT_LT(off, 4.5) << "theta " << k << " of record " << record;
      square += off * off;
      within += off < fit.quantile;
    }
    for (const std::string& warning : estimator.describe().warnings)
      EXPECT_THAT(warning, AllOf(Not(HasSubstr("periods")), Not(HasSubstr("unstable")),
                                 Not(HasSubstr("branch"))));
  }
  const double count = records * static_cast<double>(truth.size());
  EXPECT_GT(within, 0.9 * count);  // 95 % intervals
  EXPECT_GT(square / count, 0.6);
  EXPECT_LT(square / count, 1.5);
}

// From a more distant start the response need not exist at the start of the fit.
TEST_P(OverPeriods, FitFromFurtherOffGivesTheTruthOrIsNotUsable) {
  const Case& one = GetParam();
  const std::vector<double> truth = one.theta();
  EstimationOptions options;
  options.grid.points = kPoints;
  for (const double off : {-0.05, 0.05}) {
    std::vector<double> start = truth;
    for (std::size_t k = 0; k < start.size(); ++k)
      start[k] *= k % 2 == 0 ? 1.0 + off : 1.0 - 0.6 * off;
    std::mt19937_64 random(7);
    Estimator estimator(model, {noisy_record(one, random)}, options);
    const Fit& fit = estimator.fit(start);
    if (!estimator.describe().usable) continue;
    for (std::size_t k = 0; k < truth.size(); ++k)
      EXPECT_LT(std::fabs(fit.theta[k] - truth[k]), 4.5 * fit.standard_error[k]) << off;
  }
}

// Decreasing amplitude: a response of three periods branches off no other response and ends in
// a fold. One of two periods ends where it branched off; on the oleo's tyre there is a fold
// before that.
TEST_P(OverPeriods, EndsWhereTheReferenceDoes) {
  const Case& one = GetParam();
  PeriodicSystem system(model, ring);
  ASSERT_EQ(solve_from_stroke(one, system).status, SolveStatus::converged);
  ContinuationOptions options{{Scheme::order6, kPoints, true}};
  options.periods = one.periods();
  Continuation continuation(model, one.theta(), options);
  const Branch branch = continuation.from_state(Along::amplitude, one.frequency(), one.amplitude(),
                                                one.amplitude() + 1.0, 0.5, system.state());
  const auto& fold = one.known().at("fold");
  ASSERT_EQ(branch.special.size(), fold.is_null() ? 0u : 1u) << branch.ended;
  if (one.periods() == 2) {
    EXPECT_THAT(branch.ended, HasSubstr("joins the solutions of half the period"));
  }
  if (fold.is_null()) return;
  const SpecialPoint& special = branch.special.front();
  EXPECT_EQ(special.kind, Bifurcation::fold);
  EXPECT_NEAR(special.point.amplitude, fold.get<double>(), 1e-6);
  EXPECT_TRUE(branch.points[special.after].stable);
  EXPECT_FALSE(branch.points[special.after + 1].stable);
}

INSTANTIATE_TEST_SUITE_P(Reference, OverPeriods,
                         ::testing::Values(Case{"oleo_two", false, 1e-8, 1e-6, 0.05},
                                           Case{"oleo_three", false, 1e-9, 1e-7, 0.02},
                                           Case{"tyre_two", true, 1e-8, 1e-7, 0.05},
                                           Case{"tyre_three", true, 1e-9, 1e-7, 0.02}),
                         [](const auto& one) { return std::string(one.param.name); });

class Doubles : public ::testing::TestWithParam<Case> {};

TEST_P(Doubles, WhereTheReferenceDoesAndLeadsToItsMotionOfTwoPeriods) {
  const Case& one = GetParam();
  const auto& known = reference().at("doublings").at(one.tyre ? "tyre" : "oleo");
  const Model model(one.spec());
  Continuation continuation(model, one.theta(), {{Scheme::order6, kPoints, true}});
  const Branch branch = continuation.over_amplitude(one.frequency(), 1.0, one.amplitude() + 2.0);
  const auto first = std::find_if(branch.special.begin(), branch.special.end(), [](const auto& s) {
    return s.kind == Bifurcation::period_doubling;
  });
  ASSERT_NE(first, branch.special.end()) << branch.ended;
  EXPECT_NEAR(first->point.amplitude, known.at("amplitude").get<double>(), 1e-6);
  const Branch twice = continuation.doubled(branch, *first);
  const std::vector<BranchPoint> found = continuation.solutions_at(twice, one.amplitude());
  PeriodicSystem system(model, {Scheme::order6, kPoints * 2, true});
  double nearest = 1e300;
  for (const BranchPoint& point : found) {
    std::copy(point.at.z.begin(), point.at.z.end(), system.state().begin());
    nearest = std::min({nearest, apart(one, system), apart(one, system, 1)});
  }
  EXPECT_LT(nearest, one.state_error);
}

INSTANTIATE_TEST_SUITE_P(Reference, Doubles,
                         ::testing::Values(Case{"oleo_two", false, 1e-8, 1e-6, 0.0},
                                           Case{"tyre_two", true, 1e-8, 1e-6, 0.0}),
                         [](const auto& one) { return std::string(one.param.name); });

// Where no such response exists, the solution over several periods is that of one period.
void expect_one_period(PeriodicSystem& system, const std::vector<double>& theta, double frequency,
                       double amplitude, const std::vector<double>& record) {
  set_excitation_over(system, 2, frequency, amplitude);
  start_from_record(system, record, 6);
  ASSERT_GT(subharmonic_share(system, 2), 0.1);
  ASSERT_EQ(system.solve(theta).status, SolveStatus::converged);
  EXPECT_LT(subharmonic_share(system, 2), 1e-8);
}

std::vector<double> two_periods(double mean, double amplitude) {
  std::vector<double> record;
  for (int j = 0; j < 2 * kSamples; ++j)
    record.push_back(mean + amplitude * (std::cos(kTwoPi * j / kSamples) +
                                         std::cos(0.5 * kTwoPi * j / kSamples + 0.4)));
  return record;
}

TEST(NoSubharmonic, OfTheLinearOscillatorIsFoundFromAnyRecord) {
  const Model model(testing::linear_oscillator());
  const double frequency = 3.5, amplitude = 3.0;
  PeriodicSystem system(model, {Scheme::order6, 2 * kPoints, true});
  expect_one_period(system, kLinear, frequency, amplitude, two_periods(0.0, 0.05));
  const double w = kTwoPi * frequency;
  const std::complex<double> stiffness(kLinear[1] - w * w, kLinear[0] * w);
  for (int i = 0; i < 2 * kPoints; ++i) {
    const std::complex<double> turned = std::polar(amplitude, kTwoPi * i / kPoints);
    EXPECT_NEAR(system.value(i, 0), (turned / stiffness).real(), 1e-10);
  }
}

TEST(NoSubharmonic, OfTheOleoIsFoundAtThePapersAmplitude) {
  const Model model(testing::oleo());
  PeriodicSystem system(model, {Scheme::order6, 2 * kPoints, true});
  expect_one_period(system, testing::kOleoSi, 2.0, 3.048, two_periods(0.13, 0.01));
}

// Two periods of the linear oscillator, with half the frequency or noise added.
RunData linear_run(const Model& model, double half, double noise, std::mt19937_64& random) {
  PeriodicSystem system(model, {Scheme::order6, 2 * kSamples, true});
  set_excitation_over(system, 2, 3.5, 3.0);
  EXPECT_EQ(system.solve_from_rest(kLinear).status, SolveStatus::converged);
  std::normal_distribution<double> normal(0.0, 1.0);
  RunData run;
  run.frequency_hz = 3.5;
  run.amplitude = 3.0;
  run.periods = 2;
  for (int i = 0; i < system.points(); ++i)
    run.displacement.push_back(system.value(i, 0) + noise * normal(random) +
                               half * std::cos(0.5 * kTwoPi * i / kSamples));
  return run;
}

TEST(NoSubharmonic, IsSaidOfAFitToARecordThatHasOne) {
  const Model model(testing::linear_oscillator());
  std::mt19937_64 random(3);
  Estimator estimator(model, {linear_run(model, 1e-3, 1e-5, random)});
  estimator.fit(kLinear);
  const Estimate estimate = estimator.describe();
  EXPECT_THAT(estimate.warnings, Contains(HasSubstr("the data repeat after 2 periods of the "
                                                    "excitation, the fitted solution after one")));
  EXPECT_FALSE(estimate.usable);
}

// Noise does not repeat either, and must not be taken for a subharmonic.
TEST(NoSubharmonic, IsNotMissedInNoise) {
  const Model model(testing::linear_oscillator());
  std::mt19937_64 random(11);
  int said = 0;
  for (int record = 0; record < 200; ++record) {
    Estimator estimator(model, {linear_run(model, 0.0, 1e-4, random)});
    EXPECT_EQ(estimator.fit(kLinear).status, FitStatus::converged);
    for (const std::string& warning : estimator.describe().warnings)
      said += warning.find("repeat after") != std::string::npos;
  }
  EXPECT_LE(said, 4);
}

}  // namespace
}  // namespace shaker::estimator
