#include "estimator/diagnosis/fit/internal/smoothing_limit.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "sim/campaign_recorder.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using estimator::testing::effect;

RunDatum datum_of(double error) {
  RunDatum datum;
  datum.error = VectorXd::Constant(1, error);
  return datum;
}

TEST(SmoothingLimit, EliminatesAWidthItsLogarithmAndTheirSquares) {
  std::vector<MatrixXd> rungs;
  for (double e = 0.1; e > 0.002; e *= 0.5) {
    const double y = 3.0 + 2.0 * e - 7.0 * e * std::log(e) + 5.0 * e * e - e * e * std::log(e);
    rungs.push_back(MatrixXd::Constant(1, 1, y));
  }
  const SmoothingLimit limit = eliminated(rungs, datum_of(1e-3));
  EXPECT_NEAR(limit.value[0], 3.0, 1e-12);
  EXPECT_GT(std::fabs(rungs.back()(0, 0) - 3.0), 0.1);
}

// Values that no power law explains: the last elimination changes them more than the first.
TEST(SmoothingLimit, StopsWhereEliminatingMakesItWorse) {
  std::vector<MatrixXd> rungs;
  for (const double y : {1.0, -1.0, 1.0, -1.0, 1e-3})
    rungs.push_back(MatrixXd::Constant(1, 1, y));
  const SmoothingLimit limit = eliminated(rungs, datum_of(1.0));
  EXPECT_NEAR(limit.value[0], 1.002, 1e-12);
  EXPECT_NEAR(limit.open[0], 1.001, 1e-12);
}

// The damper sticks twice in a cycle; a smoothed friction creeps instead.
TEST(SmoothingLimit, IsThePeriodicMotionOfADamperThatSticks) {
  sim::CampaignRecording clean;
  clean.rig.parameters = {{"coulomb_friction", 0.4}};
  clean.rig.noise_m = 1e-9;
  clean.rig.noise_m_s2 = 1e-7;
  clean.rig.quantum_m = clean.rig.quantum_m_s2 = 0.0;
  clean.settle_cycles = 40.0;
  clean.runs = {{"r01", 0.8, 3.0, false}};
  sim::Record record = sim::record_run(clean, 0);
  Recording run;
  run.name = "r01";
  run.frequency_hz = 0.8;
  run.t = std::move(record.t);
  run.displacement = std::move(record.displacement);
  run.excitation = std::move(record.excitation);
  const SteadyRun steady = steady_cycles(run).value();

  RunDatum datum;
  datum.frequency_hz = steady.frequency_hz;
  datum.driver = steady.driver.bottomRows(8).colwise().mean();
  datum.response = steady.response.bottomRows(8).colwise().mean();
  datum.error = VectorXd::Constant(datum.response.size(), 1e-7);
  config::ModelSpec spec = estimator::testing::oleo();
  spec.effects.push_back(effect("coulomb_friction"));
  std::vector<double> theta = estimator::testing::kOleoSi;
  theta.push_back(0.4);
  const Model model(rounded_for(spec, datum, 256));
  Prediction round(model, datum, 256);
  ASSERT_TRUE(round.at(theta));
  AnalysisMatrices matrices;
  const auto limits = smoothing_limits(spec, {&datum}, theta, round, 256, matrices);
  ASSERT_TRUE(limits);
  const SmoothingLimit& limit = limits->front();
  const double off = (round.value() - datum.response).norm();
  const double left = (limit.value - datum.response).norm();
  EXPECT_GT(off, 1e-4);
  EXPECT_LT(left, 5e-7);
  EXPECT_LT(limit.open.norm(), 1e-6);
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
