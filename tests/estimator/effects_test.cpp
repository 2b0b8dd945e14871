// Every effect's partial derivatives against complex steps through an independent formula.
#include <cmath>
#include <complex>
#include <functional>
#include <map>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "estimator/effects/catalogue.hpp"
#include "estimator/math/aligned.hpp"

namespace shaker::estimator {
namespace {

using C = std::complex<double>;
struct Formula {
  std::function<C(C u, C v, C a, const std::vector<C>& theta, const std::vector<double>& constants)>
      force;
  std::vector<double> theta, constants;
};

// Written from EFFECTS' formulas, not from the code.
const std::map<std::string, Formula>& formulas() {
  static const std::map<std::string, Formula> all = {
      {"orifice_damping",
       {[](C, C v, C, const auto& t, const auto&) { return t[0] * (v.real() < 0 ? -v : v) * v; },
        {16.6667},
        {}}},
      {"gas_spring",
       {[](C u, C, C, const auto& t, const auto&) {
          return t[0] * std::pow(1.0 / (1.0 - t[1] * u), t[2]);
        },
        {1.524, 5.31496, 1.2},
        {}}},
      {"gravity", {[](C, C, C, const auto&, const auto& c) { return C(-c[0]); }, {}, {9.8}}},
      {"linear_stiffness",
       {[](C u, C, C, const auto& t, const auto& c) { return t[0] * (u - c[0]); }, {7.5}, {0.03}}},
      {"cubic_stiffness",
       {[](C u, C, C, const auto& t, const auto& c) { return t[0] * std::pow(u - c[0], 3); },
        {40.0},
        {0.02}}},
      {"viscous_damping",
       {[](C, C v, C, const auto& t, const auto&) { return t[0] * v; }, {0.25}, {}}},
  };
  return all;
}

class EveryEffect : public ::testing::TestWithParam<const Effect*> {};

TEST_P(EveryEffect, HasTheForceAndTheExactDerivativesOfItsFormula) {
  const Effect& effect = *GetParam();
  const auto found = formulas().find(std::string(effect.name()));
  ASSERT_NE(found, formulas().end()) << "no formula here for " << effect.name();
  const Formula& formula = found->second;
  const std::size_t p = effect.parameters().size();
  ASSERT_EQ(formula.theta.size(), p);
  ASSERT_EQ(formula.constants.size(), effect.constants().size());

  constexpr int kPoints = 37;  // no multiple of a lane
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> stroke(-0.05, 0.17), rate(-1.0, 1.0);
  AlignedVector u(40), v(40), a(40), out(40 * (4 + p), 1.0);
  for (int i = 0; i < kPoints; ++i) {
    u[i] = stroke(random);
    v[i] = rate(random);
    a[i] = 10.0 * rate(random);
  }
  std::vector<double*> theta_columns;
  for (std::size_t k = 0; k < p; ++k)
    theta_columns.push_back(&out[40 * (4 + k)]);
  ASSERT_TRUE(effect.evaluate({kPoints, u.data(), v.data(), a.data()}, formula.theta.data(),
                              formula.constants.data(),
                              {&out[0], &out[40], &out[80], &out[120], theta_columns.data()}));

  constexpr double h = 1e-30;
  const auto at = [&](int i, int which) {
    std::vector<C> theta(formula.theta.begin(), formula.theta.end());
    C uu = u[i], vv = v[i], aa = a[i];
    if (which == 1) uu += C(0, h);
    if (which == 2) vv += C(0, h);
    if (which == 3) aa += C(0, h);
    if (which >= 4) theta[which - 4] += C(0, h);
    return formula.force(uu, vv, aa, theta, formula.constants);
  };
  for (int i = 0; i < kPoints; ++i) {
    const double force = at(i, 0).real();
    EXPECT_NEAR(out[i] - 1.0, force, 1e-13 * (1.0 + std::fabs(force)));  // added to what was there
    for (int which = 1; which < 4 + static_cast<int>(p); ++which) {
      const double exact = at(i, which).imag() / h;
      const double got = out[40 * which + i] - (which < 4 ? 1.0 : 0.0);
      EXPECT_NEAR(got, exact, 1e-12 * (1.0 + std::fabs(exact))) << "derivative " << which;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EveryEffect,
                         ::testing::ValuesIn(catalogue().begin(), catalogue().end()),
                         [](const auto& each) { return std::string(each.param->name()); });

TEST(GasSpring, RefusesAStrokeAtItsWallAndBeyond) {
  AlignedVector u = {0.1, 0.2, 0.1, 0.1, 0, 0, 0, 0}, other(8), out(8 * 7);
  double* columns[] = {&out[32], &out[40], &out[48]};
  const double theta[] = {1.5, 5.0, 1.0};  // wall at 0.2
  const Forces forces{&out[0], &out[8], &out[16], &out[24], columns};
  EXPECT_FALSE(
      gas_spring().evaluate({4, u.data(), other.data(), other.data()}, theta, nullptr, forces));
  EXPECT_TRUE(
      gas_spring().evaluate({1, u.data(), other.data(), other.data()}, theta, nullptr, forces));
  u[0] = std::nan("");
  EXPECT_FALSE(
      gas_spring().evaluate({1, u.data(), other.data(), other.data()}, theta, nullptr, forces));
}

TEST(Catalogue, HasUniqueNamesAndAdmissibleStarts) {
  std::map<std::string_view, int> seen;
  for (const Effect* effect : catalogue()) {
    EXPECT_EQ(seen[effect->name()]++, 0) << effect->name();
    EXPECT_EQ(find_effect(effect->name()), effect);
    for (const ParameterInfo& p : effect->parameters()) {
      EXPECT_LE(p.lower, p.start) << effect->name() << "." << p.symbol;
      EXPECT_LE(p.start, p.upper) << effect->name() << "." << p.symbol;
      EXPECT_FALSE(p.unit.empty());
      EXPECT_FALSE(p.meaning.empty());
    }
  }
  EXPECT_EQ(find_effect("perpetual_motion"), nullptr);
}

}  // namespace
}  // namespace shaker::estimator
