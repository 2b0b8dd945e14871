// Compared with tests/data/multi_period: extrapolated midpoint steps and shooting in Python.
#include "estimator/fit/records/over_periods.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

struct Case {
  const char* name;
  bool tyre;
};

class StartOverPeriods : public ::testing::TestWithParam<Case> {
 protected:
  nlohmann::json known = nlohmann::json::parse(std::ifstream(
      std::filesystem::path(SHAKER_TEST_DATA) / "multi_period/reference.json"))[GetParam().name];
  std::vector<double> truth = known.at("theta");
  Model model{GetParam().tyre ? testing::oleo_on_tyre(0.1) : testing::oleo()};

  // Noise of 0.2 mm.
  RunData record(unsigned seed) const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> noise(0.0, 2e-4);
    RunData run;
    run.frequency_hz = known.at("frequency");
    run.amplitude = known.at("amplitude");
    run.periods = known.at("periods");
    for (const double u : known.at("stroke").get<std::vector<double>>())
      run.displacement.push_back(u + noise(random));
    return run;
  }
  std::vector<double> off_by(double share) const {
    std::vector<double> start = truth;
    for (std::size_t k = 0; k < start.size(); ++k)
      start[k] *= k % 2 == 0 ? 1.0 + share : 1.0 - 0.6 * share;
    return start;
  }
};

// Without this start most fits from such distant values end on another response or on a fold.
TEST_P(StartOverPeriods, LeadsTheFitToTheTruthFromFarOff) {
  EstimationOptions options;
  options.grid.points = 240;
  for (const double off : {-0.15, -0.05, 0.05}) {
    for (unsigned seed = 7; seed < 10; ++seed) {
      const RunData run = record(seed);
      const auto start = start_over_periods(model, {run}, off_by(off));
      ASSERT_TRUE(start) << off;
      Estimator estimator(model, {run}, options);
      const Fit& fit = estimator.fit(*start);
      ASSERT_EQ(fit.status, FitStatus::converged) << off << ": " << fit.trouble;
      EXPECT_TRUE(estimator.describe().usable) << off;
      for (std::size_t k = 0; k < truth.size(); ++k)
        EXPECT_LT(std::fabs(fit.theta[k] - truth[k]), 4.5 * fit.standard_error[k]) << off;
    }
  }
}

TEST_P(StartOverPeriods, TakesAMeasuredExcitationAndSamplesAtAnyTimes) {
  RunData run = record(7);
  const std::size_t n = run.displacement.size();
  for (std::size_t i = 0; i < n; ++i) {
    run.tau.push_back(static_cast<double>(i) / static_cast<double>(n));
    run.excitation.push_back(run.amplitude *
                             std::cos(6.283185307179586 * run.periods * run.tau.back()));
  }
  const auto same = start_over_periods(model, {record(7)}, off_by(-0.05));
  const auto start = start_over_periods(model, {run}, off_by(-0.05));
  ASSERT_TRUE(same && start);
  for (std::size_t k = 0; k < truth.size(); ++k)
    EXPECT_NEAR((*start)[k] / (*same)[k], 1.0, 2e-3) << k;  // error of the cubic between samples
}

TEST(StartOverPeriodsOf, CoefficientsIsNone) {
  RunData run;
  run.frequency_hz = 1.0;
  run.harmonics = {0.0, 1.0, 0.0};
  EXPECT_FALSE(start_over_periods(Model(testing::oleo()), {run}, testing::kOleoSi));
}

INSTANTIATE_TEST_SUITE_P(Reference, StartOverPeriods,
                         ::testing::Values(Case{"oleo_two", false}, Case{"oleo_three", false},
                                           Case{"tyre_two", true}, Case{"tyre_three", true}),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace shaker::estimator
