// The coefficients of the sensitivity equations (5.10), each requested alone.
#include "estimator/time/state_equations.hpp"

#include <array>

#include <gtest/gtest.h>

#include "../fixtures.hpp"

namespace shaker::estimator {
namespace {

using namespace testing;

constexpr int kLanes = 8;
using Lanes = std::array<double, kLanes>;

// u'' = x - c u' - k u.
TEST(StateEquations, GiveEachOfTheirDerivativesAlone) {
  const Model model(linear_oscillator());
  const StateEquations equations(model);
  const std::vector<double> theta = {0.25, 7.5};
  alignas(64) Lanes u{}, v{}, x{};
  u.fill(0.2);
  v.fill(-0.3);
  x.fill(1.0);
  const std::array<const double*, 2> s = {u.data(), v.data()};
  alignas(64) std::array<Lanes, 2> rate{};
  alignas(64) std::array<Lanes, 4> by_state{}, by_theta{};
  const std::array<double*, 2> r = {rate[0].data(), rate[1].data()};
  std::array<double*, 4> h_s{}, h_theta{};
  for (std::size_t k = 0; k < 4; ++k) {
    h_s[k] = by_state[k].data();
    h_theta[k] = by_theta[k].data();
  }
  StateEquations::Workspace work;
  const auto ask = [&](double* const* states, double* const* parameters) {
    return equations.rates(kLanes, s.data(), x.data(), theta.data(), work, r.data(), states,
                           parameters);
  };
  ASSERT_TRUE(ask(h_s.data(), nullptr));
  EXPECT_EQ(by_state[0][0], 0.0);
  EXPECT_EQ(by_state[1][0], 1.0);
  EXPECT_NEAR(by_state[2][0], -7.5, 1e-12);
  EXPECT_NEAR(by_state[3][0], -0.25, 1e-12);
  EXPECT_EQ(by_theta[2][0], 0.0);  // not requested: unchanged

  by_state = {};
  ASSERT_TRUE(ask(nullptr, h_theta.data()));
  EXPECT_NEAR(by_theta[2][0], 0.3, 1e-12);   // -v
  EXPECT_NEAR(by_theta[3][0], -0.2, 1e-12);  // -u
  EXPECT_EQ(by_state[2][0], 0.0);
}

// u'' (1 + m_a) = x - c u' - k u with m_a = -1.
TEST(StateEquations, RefuseACoordinateWithoutInertia) {
  const Model model(
      model_of({effect("viscous_damping"), effect("linear_stiffness"), effect("added_mass")}));
  const StateEquations equations(model);
  const std::vector<double> theta = {0.25, 7.5, -1.0};
  alignas(64) const Lanes u{}, v{}, x{};
  const std::array<const double*, 2> s = {u.data(), v.data()};
  alignas(64) std::array<Lanes, 2> rate{};
  const std::array<double*, 2> r = {rate[0].data(), rate[1].data()};
  StateEquations::Workspace work;
  EXPECT_FALSE(
      equations.rates(kLanes, s.data(), x.data(), theta.data(), work, r.data(), nullptr, nullptr));
}

}  // namespace
}  // namespace shaker::estimator
