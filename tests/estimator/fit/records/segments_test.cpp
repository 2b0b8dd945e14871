// Multiple shooting from segments of many lengths.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "estimator/fit/records/transient.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using namespace testing;

std::vector<double> scaled(std::vector<double> theta, double by) {
  for (double& value : theta)
    value *= by;
  return theta;
}

// Twenty seconds from near full extension, at 1 kHz: many swings towards the gas spring's wall.
TransientRecord free_decay(const Model& model) {
  const std::vector<double> truth = {13.3, 1.8, 4.3, 1.2};
  TransientRecord record;
  for (int i = 0; i < 20000; ++i)
    record.t.push_back(1e-3 * i);
  const StateEquations equations(model);
  TimeOptions options;
  options.relative_tolerance = 1e-11;
  Arc arc;
  arc.times = record.t;
  arc.excitation = &record.excitation;
  arc.start = {0.05, 0.0};
  EXPECT_TRUE(TimeIntegration::make(equations, options, {})->run({&arc, 1}, truth, false).ok);
  std::mt19937_64 random(8);
  std::normal_distribution<double> noise(0.0, 2e-5);
  for (std::size_t i = 0; i < arc.states.size(); i += 2)
    record.displacement.push_back(arc.states[i] + noise(random));
  return record;
}

TEST(Segments, AFreeDecayConvergesFromSegmentsOfManyLengthsAndManyStarts) {
  const Model model(oleo());
  const auto data = free_decay(model);
  const std::vector<double> truth = {13.3, 1.8, 4.3, 1.2};
  TransientOptions options;
  options.time.integrator = Integrator::runge_kutta4;
  std::vector<double> found;
  for (const std::size_t segment : {0, 24, 64, 96, 128, 152}) {
    options.segment = segment;
    TransientEstimator estimator(model, {data}, options);
    for (const double by : {0.9, 0.95, 1.05, 1.1}) {
      const auto& fit = estimator.fit(scaled(truth, by));
      ASSERT_EQ(fit.status, FitStatus::converged) << segment << " " << by << ": " << fit.trouble;
      EXPECT_LE(fit.iterations, 30) << segment << " " << by;
      if (found.empty()) found = fit.theta;
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(fit.theta[k], found[k], 1e-8 * found[k]) << segment << " " << by;
        EXPECT_LT(std::fabs(fit.theta[k] - truth[k]), 4.0 * fit.standard_error[k]);
      }
    }
  }
}

TEST(Segments, TooLongForTheMotionGiveWayToShorterOnes) {
  const Model model(oleo());
  const auto data = free_decay(model);
  TransientOptions options;
  options.time.integrator = Integrator::runge_kutta4;
  for (const std::size_t segment : {313, 400, 1000}) {
    options.segment = segment;
    TransientEstimator estimator(model, {data}, options);
    const auto& fit = estimator.fit(scaled({13.3, 1.8, 4.3, 1.2}, 0.9));
    EXPECT_EQ(fit.status, FitStatus::converged) << segment << ": " << fit.trouble;
    EXPECT_TRUE(fit.trouble.empty()) << fit.trouble;
  }
}

}  // namespace
}  // namespace shaker::estimator
