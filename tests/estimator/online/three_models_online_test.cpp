// The extended Kalman filter and the change detection on the linear oscillator (6.2), the oleo
// (6.3) and the oleo on its tyre.
#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "estimator/online/internal/extended_kalman.hpp"
#include "estimator/online/online_estimator.hpp"
#include "tests/estimator/online/cycles.hpp"
#include "tests/estimator/three_models.hpp"

namespace shaker::estimator::online {
namespace {

class ThreeModelsOnline : public ::testing::TestWithParam<estimator::testing::OneOfThree> {
 protected:
  ThreeModelsOnline() {
    known_ = GetParam().known();
    truth_ = known_.at("truth").get<std::vector<double>>();
    const auto& rows = known_.at("least_squares").at("covariance");
    covariance_.resize(parameters(), parameters());
    for (Eigen::Index a = 0; a < parameters(); ++a)
      for (Eigen::Index b = 0; b < parameters(); ++b)
        covariance_(a, b) = rows.at(static_cast<std::size_t>(a)).at(static_cast<std::size_t>(b));
  }

  Eigen::Index parameters() const { return static_cast<Eigen::Index>(truth_.size()); }

  // The specification with the start values `theta`.
  static config::ModelSpec started(const std::vector<double>& theta) {
    config::ModelSpec spec = GetParam().spec();
    const Model model(spec);
    for (std::size_t k = 0; k < theta.size(); ++k) {
      const ModelParameter& p = model.parameters()[k];
      for (auto& effect : spec.effects) {
        if (effect.effect == p.effect) effect.parameters[p.name].start = theta[k];
      }
    }
    return spec;
  }

  // The recorded runs, one cycle for each.
  std::vector<MeasuredCycle> recorded() const {
    std::vector<MeasuredCycle> cycles;
    for (const auto& run : known_.at("runs")) {
      MeasuredCycle cycle;
      cycle.run = static_cast<int>(cycles.size());
      cycle.frequency_hz = run[0];
      cycle.amplitude = run[1];
      cycles.push_back(cycle);
    }
    for (const auto& row :
         estimator::testing::read_csv(std::string("three_models/") + GetParam().name + ".csv"))
      cycles[static_cast<std::size_t>(row[0])].displacement.push_back(row[2]);
    return cycles;
  }

  nlohmann::json known_;
  std::vector<double> truth_;
  Eigen::MatrixXd covariance_;  // of the independent estimate
};

// A normal prior and the data, each with its information. Where the model is nearly linear, the
// filter must agree with linear algebra on the independent estimate and its covariance.
TEST_P(ThreeModelsOnline, ExtendedKalmanWeighsItsPriorAgainstTheData) {
  const Model model(GetParam().spec());
  const auto& answer = known_.at("least_squares");
  const auto theta = answer.at("theta").get<std::vector<double>>();
  const auto cycles = recorded();
  const double data = static_cast<double>(cycles.size() * cycles[0].displacement.size());
  const double noise = std::sqrt(answer.at("sum_of_squares").get<double>() /
                                 (data - static_cast<double>(theta.size())));
  const Eigen::VectorXd error = covariance_.diagonal().cwiseSqrt();
  // The start is off by one standard error in every independent direction.
  const Eigen::MatrixXd root = covariance_.llt().matrixL();
  const Eigen::VectorXd off = root.rowwise().sum();
  std::vector<double> start = theta, deviation;
  for (Eigen::Index k = 0; k < parameters(); ++k) {
    start[static_cast<std::size_t>(k)] += off[k];
    deviation.push_back(error[k]);
  }
  const Eigen::MatrixXd prior = error.cwiseAbs2().cwiseInverse().asDiagonal();
  const Eigen::MatrixXd expected = (covariance_.inverse() + prior).inverse();
  const Eigen::VectorXd shift = expected * prior * off;  // from the independent estimate
  ExtendedKalman filter(
      model, start,
      {.first_deviation = deviation, .noise = noise, .grid_points = GetParam().points});
  for (const auto& cycle : cycles)
    ASSERT_TRUE(filter.add(cycle));
  for (Eigen::Index a = 0; a < parameters(); ++a) {
    const auto k = static_cast<std::size_t>(a);
    EXPECT_NEAR((filter.theta()[k] - theta[k] - shift[a]) / std::sqrt(expected(a, a)), 0.0, 0.02)
        << k;
    for (Eigen::Index b = 0; b < parameters(); ++b)
      EXPECT_NEAR(
          (filter.covariance()(a, b) - expected(a, b)) / std::sqrt(expected(a, a) * expected(b, b)),
          0.0, 0.02)
          << a << "," << b;
  }
}

TEST_P(ThreeModelsOnline, ExtendedKalmanFollowsADamperThatDrifts) {
  testing::Damper damper(GetParam().spec(), 2e-5, 10);
  const Model model(GetParam().spec());
  std::vector<double> deviation, drift;
  for (const double value : truth_) {
    deviation.push_back(5e-3 * value);
    drift.push_back(1e-4 * value);
  }
  drift[0] = 5e-3 * truth_[0];
  ExtendedKalman filter(model, truth_,
                        {.first_deviation = deviation,
                         .drift = drift,
                         .noise = 2e-5,
                         .grid_points = GetParam().points});
  std::vector<double> theta = truth_;
  for (long i = 0; i < 30; ++i) {
    theta[0] = truth_[0] * (1.0 - 0.005 * static_cast<double>(i));
    ASSERT_TRUE(filter.add(damper.cycle(0, i, theta)));
  }
  EXPECT_NEAR(filter.theta()[0] / theta[0], 1.0, 0.02);
  for (std::size_t k = 1; k < theta.size(); ++k)
    EXPECT_NEAR(filter.theta()[k] / theta[k], 1.0, 0.02) << k;
}

// In this dwell the damper loses 3 % after 30 cycles. The damper's parameter is named, alone or
// with similar ones.
TEST_P(ThreeModelsOnline, ChangeOfTheDamperIsSeenWithItsSizeAndNotBefore) {
  testing::Damper damper(GetParam().spec(), 2e-5, 12);
  std::vector<double> start = truth_;
  for (double& value : start)
    value *= 1.02;
  OnlineEstimator online(started(start), {.false_alarms_per_cycle = 1e-4});
  std::vector<ParameterChange> seen;
  for (long i = 0; i < 45 && seen.empty(); ++i) {
    std::vector<double> theta = truth_;
    if (i >= 30) theta[0] *= 0.97;
    const auto estimate = online.add(damper.cycle(0, i, theta));
    ASSERT_TRUE(estimate.ok()) << i;
    seen = estimate->changes;
    EXPECT_TRUE(seen.empty() || i >= 30) << i;
  }
  const std::string name = Model(GetParam().spec()).parameters()[0].name;
  const auto found = std::find_if(seen.begin(), seen.end(),
                                  [&](const ParameterChange& one) { return one.name == name; });
  ASSERT_NE(found, seen.end());
  EXPECT_NEAR(static_cast<double>(found->cycle), 30.0, 2.0);
  EXPECT_LT(found->seen_at, 36);
  EXPECT_NEAR(found->jump, -0.03 * truth_[0], 5.0 * found->standard_error);
  EXPECT_LT(found->standard_error, 0.01 * truth_[0]);
}

INSTANTIATE_TEST_SUITE_P(Models, ThreeModelsOnline, estimator::testing::three_models(128, 320),
                         estimator::testing::name_of);

}  // namespace
}  // namespace shaker::estimator::online
