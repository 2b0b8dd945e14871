// Joints within the measured length that yield under the damper's load, in records without a period.
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/diagnosis/records/internal/transient_load.hpp"
#include "estimator/model/model.hpp"
#include "tests/estimator/diagnosis/records.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// Sum of the oleo's forces by its formulas; no gravity.
double load_of(double u, double v) {
  const auto& theta = estimator::testing::kOleoSi;
  return theta[0] * v * std::fabs(v) + theta[1] * std::pow(1.0 - theta[2] * u, -theta[3]);
}

// A sweep of an oleo on the table; the stroke is measured over joints of a stiffness.
Recording over_joints(double stiffness, double from_hz, double to_hz, std::uint64_t seed) {
  const sim::Plant plant("oleo", {});
  sim::TableMotion table;
  table.go_to(0.0, from_hz, 1e-6, 0.0);
  table.go_to(0.0, to_hz, 4.0, 5.0);
  sim::Integrator integrator(plant, plant.at_rest(), 0.0);
  std::mt19937_64 source(seed);
  std::normal_distribution<double> noise(0.0, 2e-5);
  Recording r;
  r.kind = Kind::transient;
  r.name = "r" + std::to_string(seed);
  for (int i = 0; i < 2500; ++i) {
    const double t = i / 500.0;
    integrator.advance(t, table);
    const double u = integrator.state()[0], v = integrator.state()[1];
    r.t.push_back(t);
    r.displacement.push_back(u + load_of(u, v) / stiffness + noise(source));
    r.excitation.push_back(table.acceleration(t));
  }
  return r;
}

TEST(Joint, IsNamedInSweeps) {
  constexpr double kStiffness = 2500.0;
  Campaign campaign;
  campaign.runs = {over_joints(kStiffness, 0.6, 4.0, 1), over_joints(kStiffness, 4.0, 0.8, 2)};
  const auto d = diagnose(campaign, estimator::testing::oleo());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "series_compliance");
  EXPECT_GT(d->effects[0].probability, 0.9);
  const auto& k_n = d->effects[0].parameters.at(0);
  EXPECT_NEAR(k_n.value, kStiffness, 3.0 * k_n.standard_error);
  EXPECT_LT(k_n.standard_error, 0.01 * kStiffness);
}

TEST(Joint, SeesTheLoadOfTheDamperWithItsDerivatives) {
  auto spec = estimator::testing::oleo();
  spec.effects.push_back(estimator::testing::effect("presliding_friction"));
  spec.effects.push_back(estimator::testing::effect("added_mass"));
  spec.effects.push_back(estimator::testing::effect("series_compliance"));
  const Model model(spec);
  EXPECT_TRUE(sees_load(model));
  EXPECT_FALSE(sees_load(Model(estimator::testing::oleo())));
  const StateEquations equations(model);
  const std::vector<double> theta = model.start();
  constexpr Eigen::Index kSamples = 11;  // no multiple of the lanes
  const Eigen::VectorXd excitation = Eigen::VectorXd::LinSpaced(kSamples, -3.0, 4.0);
  Eigen::MatrixXd states(kSamples, equations.states());
  for (Eigen::Index i = 0; i < kSamples; ++i) {
    const auto phase = static_cast<double>(i);
    states.row(i) << 0.05 + 0.03 * std::cos(phase), 1e-4 * std::sin(phase), 0.4 * std::sin(phase);
  }
  const auto at = [&](const std::vector<double>& parameters, const Eigen::MatrixXd& moved) {
    const auto load = transient_load(equations, parameters, excitation, moved);
    EXPECT_TRUE(load);
    return load->value;
  };
  const auto load = transient_load(equations, theta, excitation, states);
  ASSERT_TRUE(load);
  for (Eigen::Index j = 0; j < states.cols(); ++j) {
    const double step = 1e-5 * states.col(j).cwiseAbs().maxCoeff();
    Eigen::MatrixXd up = states, down = states;
    up.col(j).array() += step;
    down.col(j).array() -= step;
    const Eigen::VectorXd slope = (at(theta, up) - at(theta, down)) / (2.0 * step);
    EXPECT_LT((load->over_states.col(j) - slope).norm(), 1e-5 * slope.norm()) << "state " << j;
  }
  for (std::size_t k = 0; k < theta.size(); ++k) {
    const double step = 1e-6 * std::max(std::fabs(theta[k]), 1e-3);
    std::vector<double> up = theta, down = theta;
    up[k] += step;
    down[k] -= step;
    const Eigen::VectorXd slope = (at(up, states) - at(down, states)) / (2.0 * step);
    EXPECT_LT((load->over_parameters.col(static_cast<Eigen::Index>(k)) - slope).norm(),
              1e-6 * slope.norm() + 1e-9)
        << model.parameters()[k].symbol;
  }
  states(3, 0) = 1.0;  // beyond the end of the gas
  EXPECT_FALSE(transient_load(equations, theta, excitation, states));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
