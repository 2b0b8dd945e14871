// The coefficients of the sensitivity equations (5.10), each requested alone.
#include "estimator/solve/time/state_equations.hpp"

#include <array>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/model_arrays.hpp"
#include "tests/estimator/fixtures.hpp"

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

// Largest |g| at the rates that `equations` give in random states, over the largest term of q in g;
// negative: it gives none.
double left_by(const Model& model, const StateEquations& equations, std::mt19937_64& source) {
  const auto c = static_cast<std::size_t>(model.coordinates());
  const auto m = static_cast<std::size_t>(equations.states());
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  AlignedVector store(kLanes * (2 * m + 1));
  std::vector<const double*> s;
  std::vector<double*> rate;
  for (std::size_t j = 0; j < m; ++j) {
    double* at = store.data() + j * kLanes;
    const bool coordinate = j < c;
    for (int i = 0; i < kLanes; ++i)
      at[i] = (coordinate ? model.rest(static_cast<int>(j)) : 0.0) +
              share(source) * (coordinate ? 0.02 : 0.8);
    s.push_back(at);
    rate.push_back(store.data() + (m + j) * kLanes);
  }
  double* x = store.data() + 2 * m * kLanes;
  std::fill_n(x, kLanes, 3.0);
  StateEquations::Workspace work;
  const auto theta = model.start();
  if (!equations.rates(kLanes, s.data(), x, theta.data(), work, rate.data(), nullptr, nullptr))
    return -1.0;
  ModelArrays at;
  at.shape(model, kLanes);
  for (std::size_t e = 0; e < c; ++e) {
    const int speed = equations.velocity_of(static_cast<int>(e));
    const auto v = static_cast<std::size_t>(speed);
    std::copy_n(s[e], kLanes, at.u[e]);
    std::copy_n(speed >= 0 ? s[v] : rate[e], kLanes, at.v[e]);
    if (speed >= 0) std::copy_n(rate[v], kLanes, at.a[e]);
  }
  EXPECT_TRUE(at.evaluate(model, kLanes, theta.data(), x));
  double worst = 0.0;
  for (std::size_t d = 0; d < c; ++d) {
    for (int i = 0; i < kLanes; ++i) {
      double largest = 1e-9;
      for (std::size_t e = 0; e < c; ++e) {
        const bool fast = equations.velocity_of(static_cast<int>(e)) >= 0;
        largest = std::max(largest, fast ? std::fabs(at.g_a[d * c + e][i] * at.a[e][i])
                                         : std::fabs(at.g_v[d * c + e][i] * at.v[e][i]));
      }
      worst = std::max(worst, std::fabs(at.g[d][i]) / largest);
    }
  }
  return worst;
}

TEST(StateEquations, SolveTheModelsEquationsWithEachEffectOfTheCatalogue) {
  std::set<std::string> with_memory;
  for (const Effect* one : catalogue()) {
    const std::string name(one->name());
    std::seed_seq of_its_own(name.begin(), name.end());
    std::mt19937_64 source(of_its_own);
    if (one->instrument() != nullptr || one->parameters().empty()) continue;
    std::vector<config::EffectSpec> effects = {effect("linear_stiffness"),
                                               effect("viscous_damping"), effect("orifice_damping"),
                                               effect("gas_spring")};
    if (std::none_of(effects.begin(), effects.end(),
                     [&](const config::EffectSpec& line) { return line.effect == name; }))
      effects.push_back(effect(name));
    if (name == "tabulated_pin") effects.back().table = {{-0.05, -0.02, 0.0, 0.02, 0.05}, {}};
    const Model model(model_of(effects));
    if (model.needs_carrier()) continue;
    const StateEquations equations(model);
    for (int round = 0; round < 20; ++round) {
      const double left = left_by(model, equations, source);
      if (left < 0.0) continue;
      EXPECT_LT(left, 1e-6) << name;  // a stiff part cancels some digits
      if (model.coordinates() > 1) with_memory.insert(name);
    }
  }
  EXPECT_GE(with_memory.size(), 7U) << "effects with coordinates of their own";
}

}  // namespace
}  // namespace shaker::estimator
