// Whole models with internal states, borrowed parameters, exciter and instrument effects: the
// rows of the Jacobian must equal the derivatives of the predictions.
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>

#include "estimator/math/numbers.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

constexpr Quantity kAll[] = {Quantity::displacement, Quantity::velocity, Quantity::acceleration,
                             Quantity::absolute_acceleration, Quantity::damper_force};

// The paper's oleo with its parameters at their true values, and further effects.
config::ModelSpec oleo_with(const std::vector<config::EffectSpec>& further) {
  auto spec = testing::oleo();
  spec.effects[0].parameters["theta1"].start = testing::kOleoSi[0];
  spec.effects[1].parameters["theta2"].start = testing::kOleoSi[1];
  spec.effects[1].parameters["theta3"].start = testing::kOleoSi[2];
  spec.effects[1].parameters["theta4"].start = testing::kOleoSi[3];
  spec.effects.insert(spec.effects.end(), further.begin(), further.end());
  return spec;
}

config::EffectSpec with(const std::string& name, const std::map<std::string, double>& values) {
  auto spec = testing::effect(name);
  for (const auto& [symbol, value] : values)
    spec.parameters[symbol].start = value;
  return spec;
}

// Compares the rows of every channel with fourth-order differences of solved predictions.
void expect_exact_rows(const config::ModelSpec& spec, double tolerance = 1e-6) {
  const Model model(spec);
  PeriodicSystem system(model, {Scheme::order6, 96, false});
  system.set_channels(kAll);
  system.set_excitation(2.0, 3.0);
  auto theta = model.start();
  ASSERT_EQ(system.solve_from_rest(theta).status, SolveStatus::converged);
  const int channels = static_cast<int>(std::size(kAll));
  const int p = model.parameter_count();
  std::vector<std::vector<double>> slopes(static_cast<std::size_t>(channels * p));
  for (int c = 0; c < channels; ++c) {
    for (int k = 0; k < p; ++k) {
      for (int i = 0; i < system.points(); ++i)
        slopes[c * p + k].push_back(system.observed_row(i, c)[1 + k]);
    }
  }
  for (int k = 0; k < p; ++k) {
    const double h = std::max(4e-4 * std::fabs(theta[k]), 1e-6);
    std::vector<double> slope(static_cast<std::size_t>(channels * system.points()), 0.0);
    constexpr double kWeights[] = {1.0 / 12, -2.0 / 3, 0.0, 2.0 / 3, -1.0 / 12};
    for (int m = -2; m <= 2; ++m) {
      auto moved = theta;
      moved[k] += m * h;
      ASSERT_EQ(system.solve(moved).status, SolveStatus::converged);
      for (std::size_t j = 0; j < slope.size(); ++j)
        slope[j] += kWeights[m + 2] / h *
                    system.observed(static_cast<int>(j) % system.points(),
                                    static_cast<int>(j) / system.points());
    }
    for (int c = 0; c < channels; ++c) {
      double worst = 0.0, largest = 1e-3;
      for (int i = 0; i < system.points(); ++i) {
        const std::size_t j = static_cast<std::size_t>(c * system.points() + i);
        const double exact = slope[j];
        worst = std::max(worst, std::fabs(exact - slopes[c * p + k][i]));
        largest = std::max(largest, std::fabs(exact));
      }
      EXPECT_LT(worst, tolerance * largest + 1e-11 / h)
          << name(kAll[c]) << " over " << model.parameters()[k].name;
    }
  }
}

TEST(Observation, OfTheOleoHasExactRows) {
  expect_exact_rows(oleo_with({}));
}

TEST(Observation, ThroughInstrumentsHasExactRows) {
  expect_exact_rows(
      oleo_with({with("sensor_delay", {{"d", 0.004}}), with("sensor_gain", {{"G", 1.03}})}));
}

TEST(Observation, OfInternalStatesBorrowedParametersAndExcitersHasExactRows) {
  expect_exact_rows(
      oleo_with({with("presliding_friction", {{"f_c", 0.4}, {"z0", 3e-3}}),
                 with("pressure_friction", {{"mu", 0.02}}), with("exciter_gain", {{"G", 1.05}}),
                 with("sensor_gain", {{"G", 0.97}})}));
}

TEST(Observation, OfEveryEffectAddedToTheOleoHasExactRows) {
  for (const Effect* effect : catalogue()) {
    const std::string name(effect->name());
    auto spec = oleo_with({});
    const bool there = std::any_of(spec.effects.begin(), spec.effects.end(),
                                   [&](const auto& e) { return e.effect == name; });
    // The prediction of the quantiser is not a smooth function of its step: see effects_test.
    if (there || name == "sensor_quantisation") continue;
    spec.effects.push_back(testing::effect(name));
    if (name == "tabulated_pin") spec.effects.back().table = {{0.0, 0.05, 0.1, 0.15, 0.2}, {}};
    SCOPED_TRACE(name);
    expect_exact_rows(spec, 2e-5);
  }
}

// Compares the catalogue's tyre with the same system in two coordinates.
TEST(Observation, OfTheTyreIsThatOfTwoCoordinates) {
  auto two = testing::oleo_on_tyre(0.15);
  two.effects[3].parameters["k"].start = 900.0;
  two.effects[4].parameters["c"].start = 4.0;
  const auto own = oleo_with({with("tyre", {{"r", 0.15}, {"k_t", 900.0}, {"c_t", 4.0}})});
  for (int e = 0; e < 2; ++e)
    two.effects[e].parameters = own.effects[e].parameters;
  const Model a(own), b(two);
  PeriodicSystem one(a, {Scheme::order6, 128, false}), other(b, {Scheme::order6, 128, false});
  for (PeriodicSystem* system : {&one, &other}) {
    system->set_channels(kAll);
    system->set_excitation(2.0, 3.0);
    ASSERT_EQ(system->solve_from_rest(system->model().start()).status, SolveStatus::converged);
  }
  for (int i = 0; i < 128; ++i) {
    for (int c = 0; c < static_cast<int>(std::size(kAll)); ++c)
      EXPECT_NEAR(one.observed(i, c), other.observed(i, c), 1e-7);
  }
}

TEST(Observation, OfTheOleoOnATyreHasExactRows) {
  expect_exact_rows(testing::oleo_on_tyre(0.15), 1e-5);  // soft tyre: rounding in the differences
}

TEST(Observation, ShowsAGainAndADelayOfTheDisplacement) {
  const Model plain(oleo_with({}));
  const Model seen(
      oleo_with({with("sensor_gain", {{"G", 1.05}}), with("sensor_delay", {{"d", 1.0 / 128}})}));
  PeriodicSystem a(plain, {Scheme::order6, 128, true});
  PeriodicSystem b(seen, {Scheme::order6, 128, true});
  for (PeriodicSystem* system : {&a, &b}) {
    system->set_excitation(2.0, 3.0);  // a delay of two points
    ASSERT_EQ(system->solve_from_rest(system->model().start()).status, SolveStatus::converged);
  }
  for (int i = 0; i < 128; ++i)
    EXPECT_NEAR(b.observed(i), 1.05 * a.observed((i + 126) % 128), 1e-9);
}

// The record of a distorted excitation is late by a delay: the effect must restore the true
// motion.
TEST(Observation, UndoesTheDelayOfARecordedExcitation) {
  constexpr int kPoints = 128;
  constexpr double kFrequency = 2.0, kLate = 0.006;
  const auto recorded = [&](double late) {
    std::vector<double> x;
    for (int i = 0; i < kPoints; ++i) {
      const double phase = kTwoPi * (static_cast<double>(i) / kPoints - kFrequency * late);
      x.push_back(3.0 * std::cos(phase - 0.4) + 0.3 * std::sin(2.0 * phase) +
                  0.2 * std::cos(3.0 * phase) + 0.1 * std::cos(5.0 * phase + 1.0));
    }
    return x;
  };
  const Model plain(oleo_with({}));
  const Model late(oleo_with({with("exciter_delay", {{"d", kLate}})}));
  PeriodicSystem a(plain, {Scheme::order6, kPoints, true});
  PeriodicSystem b(late, {Scheme::order6, kPoints, true});
  a.set_excitation_points(kFrequency, recorded(0.0));
  b.set_excitation_points(kFrequency, recorded(kLate));
  for (PeriodicSystem* system : {&a, &b}) {
    system->set_channels(kAll);
    ASSERT_EQ(system->solve_from_rest(system->model().start()).status, SolveStatus::converged);
  }
  for (int i = 0; i < kPoints; ++i) {
    for (int c = 0; c < static_cast<int>(std::size(kAll)); ++c)
      EXPECT_NEAR(b.observed(i, c), a.observed(i, c), 1e-8);
  }
}

// Newton's law, calculated independently: the load on the mass is what accelerates it.
TEST(Observation, OfTheLoadIsTheMassTimesItsAccelerationAndWeight) {
  for (const auto& spec :
       {oleo_with({with("presliding_friction", {})}), testing::oleo_on_tyre(0.15),
        oleo_with({with("exciter_gain", {{"G", 1.1}})})}) {
    const Model model(spec);
    PeriodicSystem system(model, {Scheme::order4, 128, false});
    const Quantity both[] = {Quantity::absolute_acceleration, Quantity::damper_force};
    system.set_channels(both);
    system.set_excitation(2.0, 3.0);
    ASSERT_EQ(system.solve_from_rest(model.start()).status, SolveStatus::converged);
    for (int i = 0; i < 128; ++i)
      EXPECT_NEAR(system.observed(i, 1), system.observed(i, 0) + 9.80665, 1e-7);
  }
}

}  // namespace
}  // namespace shaker::estimator
