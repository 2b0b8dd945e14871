// Compares the equations and partial derivatives of every effect with complex steps through an
// independent formula. The tests go through the catalogue and fail for an effect without a
// formula.
#include <cmath>
#include <map>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "estimator/math/aligned.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/instrument/instrument.hpp"
#include "tests/estimator/model/effects/formulas.hpp"

namespace shaker::estimator {
namespace {

using testing::C;
using testing::Formula;
constexpr int kOddPoints = 37;  // not a multiple of the number of lanes
constexpr int kRoom = 40;
constexpr double kStep = 1e-30;

// Arrays in one allocation, and pointers to them.
struct Arrays {
  explicit Arrays(std::size_t count, double value = 0.0) : store(count * kRoom, value) {
    for (std::size_t k = 0; k < count; ++k)
      at.push_back(&store[k * kRoom]);
  }
  AlignedVector store;
  std::vector<double*> at;
};

class EveryEffect : public ::testing::TestWithParam<const Effect*> {};

// Changes one variable of a formula: u, v, a, x, then w, w', w'' of each internal coordinate,
// then the parameters.
void step(testing::Seen& seen, std::size_t which, double by) {
  const std::size_t k = seen.w.size();
  const C change(0.0, by);
  C* first[] = {&seen.u, &seen.v, &seen.a, &seen.x};
  if (which < 4)
    *first[which] += change;
  else if (which < 4 + k)
    seen.w[which - 4] += change;
  else if (which < 4 + 2 * k)
    seen.w_dot[which - 4 - k] += change;
  else if (which < 4 + 3 * k)
    seen.w_ddot[which - 4 - 2 * k] += change;
  else
    seen.t[which - 4 - 3 * k] += change;
}

// The carrier of the points, and the harmonics of the excitation.
constexpr double kAmplitude = 3.0, kOmega = 17.0;
const std::vector<double> kHarmonics = {3.0, 0.1, -0.2, 0.3, 0.25, -0.15, 0.05, 0.12, -0.07, 0.02};

// Random points of a motion with k internal coordinates: u, v, a, x, quadrature, carrier cos and
// sin, then w, w', w''.
struct Inputs {
  explicit Inputs(std::size_t internals) : k(internals), in(7 + 3 * k) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> stroke(-0.05, 0.17), rate(-1.0, 1.0);
    for (int i = 0; i < kOddPoints; ++i) {
      in.at[0][i] = stroke(random);
      for (std::size_t m = 1; m < in.at.size(); ++m)
        in.at[m][i] = rate(random);
      in.at[2][i] *= 10.0;
      for (std::size_t m = 7; m < 7 + k; ++m)
        in.at[m][i] = 0.55 + 0.4 * in.at[m][i];  // a temperature must be positive
    }
  }
  Points points() const {
    Points points;
    points.n = kOddPoints;
    points.u = in.at[0];
    points.v = in.at[1];
    points.a = in.at[2];
    points.x = in.at[3];
    points.x_quadrature = in.at[4];
    points.carrier_cos = in.at[5];
    points.carrier_sin = in.at[6];
    points.carrier_amplitude = kAmplitude;
    points.carrier_omega = kOmega;
    points.harmonics = kHarmonics.data();
    points.w = in.at.data() + 7;
    points.w_dot = in.at.data() + 7 + k;
    points.w_ddot = in.at.data() + 7 + 2 * k;
    return points;
  }
  std::size_t k;
  Arrays in;
};

// Point i as the formula sees it.
testing::Seen seen_at(const Points& points, std::size_t k, int i, const Formula& formula) {
  testing::Seen seen;
  seen.u = points.u[i];
  seen.v = points.v[i];
  seen.a = points.a[i];
  seen.x = points.x[i];
  seen.x_quadrature = points.x_quadrature[i];
  seen.carrier_cos = points.carrier_cos[i];
  seen.carrier_sin = points.carrier_sin[i];
  seen.carrier_amplitude = kAmplitude;
  seen.carrier_omega = kOmega;
  seen.harmonics = kHarmonics;
  for (std::size_t m = 0; m < k; ++m) {
    seen.w.push_back(points.w[m][i]);
    seen.w_dot.push_back(points.w_dot[m][i]);
    seen.w_ddot.push_back(points.w_ddot[m][i]);
  }
  seen.t.assign(formula.theta.begin(), formula.theta.end());
  seen.c = formula.constants;
  return seen;
}

// Room for the force and k further equations. A row has f, f_u, f_v, f_a, f_x, f_w, f_w', f_w'',
// f_theta. The force's row begins with ones, since effects add to it.
struct Outputs {
  Outputs(std::size_t internals, std::size_t parameters)
      : k(internals), width(5 + 3 * k + parameters) {
    for (std::size_t r = 0; r < 1 + k; ++r)
      out.emplace_back(width, r == 0 ? 1.0 : 0.0);
    for (std::size_t r = 1; r < 1 + k; ++r) {
      double* const* row = out[r].at.data();
      h.push_back(row[0]);
      h_u.push_back(row[1]);
      h_v.push_back(row[2]);
      h_a.push_back(row[3]);
      h_x.push_back(row[4]);
      h_w.insert(h_w.end(), row + 5, row + 5 + k);
      h_w_dot.insert(h_w_dot.end(), row + 5 + k, row + 5 + 2 * k);
      h_w_ddot.insert(h_w_ddot.end(), row + 5 + 2 * k, row + 5 + 3 * k);
      h_theta.insert(h_theta.end(), row + 5 + 3 * k, row + width);
    }
  }
  Forces forces(bool sees_x) {
    double* const* force = out[0].at.data();
    Forces forces;
    forces.f = force[0];
    forces.f_u = force[1];
    forces.f_v = force[2];
    forces.f_a = force[3];
    if (sees_x) forces.f_x = force[4];
    forces.f_w = force + 5;
    forces.f_w_dot = force + 5 + k;
    forces.f_w_ddot = force + 5 + 2 * k;
    forces.f_theta = force + 5 + 3 * k;
    forces.h = h.data();
    forces.h_u = h_u.data();
    forces.h_v = h_v.data();
    forces.h_a = h_a.data();
    forces.h_x = h_x.data();
    forces.h_w = h_w.data();
    forces.h_w_dot = h_w_dot.data();
    forces.h_w_ddot = h_w_ddot.data();
    forces.h_theta = h_theta.data();
    return forces;
  }
  std::size_t k, width;
  std::vector<Arrays> out;
  std::vector<double*> h, h_u, h_v, h_a, h_x, h_w, h_w_dot, h_w_ddot, h_theta;
};

TEST_P(EveryEffect, HasTheEquationsAndTheExactDerivativesOfItsFormula) {
  const Effect& effect = *GetParam();
  const auto found = testing::formulas().find(std::string(effect.name()));
  ASSERT_NE(found, testing::formulas().end()) << "no formula here for " << effect.name();
  const Formula& formula = found->second;
  const std::size_t p = effect.parameters().size() + effect.borrows().size();
  const std::size_t k = effect.internals().size();
  ASSERT_EQ(formula.theta.size(), p);
  ASSERT_EQ(formula.constants.size(), effect.constants().size());

  const Inputs inputs(k);
  const Points points = inputs.points();
  Outputs outputs(k, p);
  const bool sees_x = effect.sees_excitation() && effect.group() != Group::exciter;
  Forces forces = outputs.forces(sees_x);
  ASSERT_TRUE(effect.evaluate(points, formula.theta.data(), formula.constants.data(), forces));

  const std::vector<Arrays>& out = outputs.out;
  for (int i = 0; i < kOddPoints; ++i) {
    const testing::Seen seen = seen_at(points, k, i, formula);
    const auto value = formula.equations(seen);
    ASSERT_EQ(value.size(), 1 + k);
    for (std::size_t r = 0; r < 1 + k; ++r) {
      const double already = r == 0 ? 1.0 : 0.0;
      EXPECT_NEAR(out[r].at[0][i] - already, value[r].real(),
                  1e-13 * (1.0 + std::fabs(value[r].real())));
    }
    for (std::size_t which = 0; which < outputs.width - 1; ++which) {
      testing::Seen stepped = seen;
      step(stepped, which, kStep);
      const auto moved = formula.equations(stepped);
      for (std::size_t r = 0; r < 1 + k; ++r) {
        if (which == 3 && !sees_x) continue;
        const double exact = moved[r].imag() / kStep;
        const double already = r == 0 && which < 3 ? 1.0 : 0.0;
        EXPECT_NEAR(out[r].at[1 + which][i] - already, exact, 2e-12 * (1.0 + std::fabs(exact)))
            << effect.name() << ": equation " << r << ", derivative " << which << ", point " << i;
      }
    }
  }
}

// A search that runs away must not come home with a number.
TEST_P(EveryEffect, IsNoNumberWhereItsFormulaIsNone) {
  const Effect& effect = *GetParam();
  const Formula& formula = testing::formulas().at(std::string(effect.name()));
  const std::size_t k = effect.internals().size();
  const Inputs inputs(k);
  for (const std::size_t input : {0, 1, 2})
    inputs.in.at[input][0] = std::nan("");
  for (std::size_t m = 7; m < inputs.in.at.size(); ++m)
    inputs.in.at[m][0] = std::nan("");
  const Points points = inputs.points();
  Outputs outputs(k, formula.theta.size());
  const bool sees_x = effect.sees_excitation() && effect.group() != Group::exciter;
  if (!effect.evaluate(points, formula.theta.data(), formula.constants.data(),
                       outputs.forces(sees_x)))
    return;
  const auto value = formula.equations(seen_at(points, k, 0, formula));
  for (std::size_t r = 0; r < value.size(); ++r) {
    if (!std::isnan(value[r].real())) continue;
    EXPECT_TRUE(std::isnan(outputs.out[r].at[0][0])) << "equation " << r;
  }
}

std::vector<const Effect*> those(bool instruments) {
  std::vector<const Effect*> list;
  for (const Effect* effect : catalogue()) {
    if ((effect->instrument() != nullptr) == instruments) list.push_back(effect);
  }
  return list;
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EveryEffect, ::testing::ValuesIn(those(false)),
                         [](const auto& each) { return std::string(each.param->name()); });

class EveryInstrument : public ::testing::TestWithParam<const Effect*> {};

TEST_P(EveryInstrument, HasTheSignalAndTheExactDerivativesOfItsFormula) {
  const Effect& effect = *GetParam();
  const Instrument& instrument = *effect.instrument();
  const auto found = testing::sensings().find(std::string(effect.name()));
  ASSERT_NE(found, testing::sensings().end()) << "no formula here for " << effect.name();
  const testing::Sensing& formula = found->second;
  const std::size_t p = effect.parameters().size();
  ASSERT_EQ(formula.theta.size(), p);
  ASSERT_EQ(formula.constants.size(), effect.constants().size());
  if (instrument.filters()) {
    for (double omega = 0.0; omega < 500.0; omega += 7.0) {
      std::vector<C> slopes(p);
      const C got =
          instrument.transfer(omega, formula.theta.data(), formula.constants.data(), slopes.data());
      EXPECT_LT(std::abs(got - formula.transfer(omega, formula.theta)), 1e-14);
      for (std::size_t k = 0; k < p; ++k) {
        auto above = formula.theta, below = formula.theta;
        const double h = 1e-5 * formula.theta[k];
        above[k] += h;
        below[k] -= h;
        const C slope =
            (formula.transfer(omega, above) - formula.transfer(omega, below)) / (2.0 * h);
        EXPECT_LT(std::abs(slopes[k] - slope), 1e-8 * (1.0 + std::abs(slope)));
      }
    }
    return;
  }
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> stroke(-0.05, 0.17), load(-9.0, 15.0), time(-0.3, 0.3);
  Arrays in(3), out(3 + p);
  for (int i = 0; i < kOddPoints; ++i) {
    in.at[0][i] = stroke(random);
    in.at[1][i] = load(random);
    in.at[2][i] = time(random);
  }
  instrument.observe({kOddPoints, in.at[0], in.at[1], in.at[2]}, formula.theta.data(),
                     formula.constants.data(),
                     {out.at[0], out.at[1], out.at[2], out.at.data() + 3});
  for (int i = 0; i < kOddPoints; ++i) {
    const auto at = [&](int which) {
      testing::SeenSignal seen{in.at[0][i],
                               in.at[1][i],
                               in.at[2][i],
                               {formula.theta.begin(), formula.theta.end()},
                               formula.constants};
      if (which == 1) seen.y += C(0, kStep);
      if (which == 2) seen.load += C(0, kStep);
      if (which >= 3) seen.theta[static_cast<std::size_t>(which - 3)] += C(0, kStep);
      return formula.pointwise(seen);
    };
    EXPECT_NEAR(out.at[0][i], at(0).real(), 1e-14);
    for (int which = 1; which < 3 + static_cast<int>(p); ++which) {
      if (which == 2 && !instrument.sees_load()) continue;
      const double exact = at(which).imag() / kStep;
      EXPECT_NEAR(out.at[static_cast<std::size_t>(which)][i], exact,
                  1e-12 * (1.0 + std::fabs(exact)))
          << "derivative " << which;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EveryInstrument, ::testing::ValuesIn(those(true)),
                         [](const auto& each) { return std::string(each.param->name()); });

TEST(GasSpring, RefusesAStrokeAtItsWallAndBeyond) {
  AlignedVector u = {0.1, 0.2, 0.1, 0.1, 0, 0, 0, 0}, other(8), out(8 * 7);
  double* columns[] = {&out[32], &out[40], &out[48]};
  const double theta[] = {1.5, 5.0, 1.0};  // wall at 0.2
  Forces forces;
  forces.f = &out[0];
  forces.f_u = &out[8];
  forces.f_v = &out[16];
  forces.f_a = &out[24];
  forces.f_theta = columns;
  Points points{4, u.data(), other.data(), other.data()};
  EXPECT_FALSE(gas_spring().evaluate(points, theta, nullptr, forces));
  points.n = 1;
  EXPECT_TRUE(gas_spring().evaluate(points, theta, nullptr, forces));
  u[0] = std::nan("");
  EXPECT_FALSE(gas_spring().evaluate(points, theta, nullptr, forces));
}

TEST(Catalogue, HasUniqueNamesAndAdmissibleStarts) {
  std::map<std::string_view, int> seen;
  for (const Effect* effect : catalogue()) {
    EXPECT_EQ(seen[effect->name()]++, 0) << effect->name();
    EXPECT_EQ(find_effect(effect->name()), effect);
    EXPECT_FALSE(effect->formula().empty()) << effect->name();
    EXPECT_FALSE(effect->meaning().empty()) << effect->name();
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
