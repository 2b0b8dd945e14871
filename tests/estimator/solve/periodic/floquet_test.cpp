// Floquet multipliers against the paper's cases (calculated by other code), closed forms and
// Odeint.
#include "estimator/solve/periodic/floquet.hpp"

#include <cmath>
#include <fstream>
#include <numbers>

#include <Eigen/Dense>
#include <boost/numeric/odeint.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using Complex = std::complex<double>;

Floquet multipliers(const Model& model, const std::vector<double>& theta, double frequency,
                    double amplitude, GridOptions grid = {Scheme::order6, 320, true}) {
  PeriodicSystem system(model, grid);
  system.set_excitation(frequency, amplitude);
  const auto report = system.solve_from_rest(theta);
  EXPECT_EQ(report.status, SolveStatus::converged) << report.sentence();
  auto result = floquet(system, theta);
  EXPECT_TRUE(result.ok());
  return *result;
}

void expect_pair(const Floquet& got, double re, double im, double tolerance) {
  ASSERT_EQ(got.multipliers.size(), 2u);
  EXPECT_NEAR(got.multipliers[0].real(), re, tolerance);
  EXPECT_NEAR(got.multipliers[0].imag(), im, tolerance);
  EXPECT_NEAR(got.multipliers[1].real(), re, tolerance);
  EXPECT_NEAR(got.multipliers[1].imag(), -im, tolerance);
  EXPECT_TRUE(got.stable());
}

TEST(Floquet, HasTheMultipliersOfThePapersFiguresToAllPrintedDigits) {
  const Model model(testing::oleo(32.178));
  expect_pair(multipliers(model, testing::kOleoFeet, 2.0, 10.0), -.285257, .182309, 5e-7);
  expect_pair(multipliers(model, testing::kOleoFeet, 2.0, 5.0), -.543084, .184066, 5e-7);
  expect_pair(multipliers(model, testing::kOleoFeet, 1.0, 10.0), .200176, .198631, 5e-7);
}

TEST(Floquet, HasThoseOfTheIndependentReproductionToItsDigits) {
  std::ifstream file(std::filesystem::path(SHAKER_TEST_DATA) / "verbeek1991.json");
  const auto reference = nlohmann::json::parse(file);
  for (const auto& one : reference["periodic"]) {
    if (!one.contains("floquet_re")) continue;
    const Model model(testing::oleo(one["grav"]));
    const Floquet got =
        multipliers(model, testing::kOleoFeet, one["f"], one["amp"], {Scheme::order6, 640, true});
    const double im = std::fabs(one["floquet_im"][0].get<double>());
    expect_pair(got, one["floquet_re"][0], im, 2e-10);
  }
}

TEST(Floquet, FallsWithTheAmplitudeAsTheReproductionFound) {
  const Model model(testing::oleo(32.178));
  const struct {
    double frequency, amplitude, modulus;
  } rows[] = {{2, 2.5, .753}, {2, 5, .573}, {2, 10, .339}, {2, 15, .189}, {2, 20, .096},
              {1, 2.5, .850}, {1, 5, .660}, {1, 10, .282}, {1, 15, .108}, {1, 20, .107}};
  for (const auto& row : rows)
    EXPECT_NEAR(multipliers(model, testing::kOleoFeet, row.frequency, row.amplitude).largest(),
                row.modulus, 5.1e-4)
        << row.frequency << " Hz, " << row.amplitude;
}

TEST(Floquet, OfALinearOscillatorIsItsFreeDecayOverAPeriod) {
  const Model model(testing::linear_oscillator());
  const double c = 0.8, k = 30.0, f = 1.7;
  const Floquet got = multipliers(model, {c, k}, f, 2.0, {Scheme::order4, 64, true});
  const Complex exponent(-c / 2, std::sqrt(k - c * c / 4));
  const Complex expected = std::exp(exponent / f);
  EXPECT_NEAR(std::abs(got.multipliers[0] - expected) * std::abs(got.multipliers[1] - expected), 0,
              1e-10);
  EXPECT_NEAR(got.largest(), std::abs(expected), 1e-10);
}

TEST(FloquetModes, OfALinearOscillatorAreItsFreeDecay) {
  const Model model(testing::linear_oscillator());
  const double c = 0.8, k = 30.0, f = 1.7;
  PeriodicSystem system(model, {Scheme::order4, 64, true});
  system.set_excitation(f, 2.0);
  const std::vector<double> theta = {c, k};
  ASSERT_EQ(system.solve_from_rest(theta).status, SolveStatus::converged);
  const auto modes = floquet_modes(system, theta);
  ASSERT_TRUE(modes);
  ASSERT_EQ(modes->size(), 1u);  // a pair
  Complex exponent(-c / 2, std::sqrt(k - c * c / 4));
  const FloquetMode& mode = modes->front();
  if (std::exp(exponent / f).imag() < 0.0) exponent = std::conj(exponent);
  EXPECT_NEAR(std::abs(mode.multiplier - std::exp(exponent / f)), 0.0, 1e-6);
  ASSERT_EQ(mode.shape.size(), 64u);
  for (std::size_t i = 0; i < 64; ++i)
    EXPECT_NEAR(std::abs(mode.shape[i] / mode.shape[0] -
                         std::exp(exponent * (static_cast<double>(i) / 64.0 / f))),
                0.0, 1e-6);
}

TEST(Floquet, IsTheSameOnEveryScheme) {
  const Model model(testing::oleo());
  const auto reference = multipliers(model, testing::kOleoSi, 2.0, 3.048);
  for (const auto& [scheme, points] :
       {std::pair{Scheme::order2, 2000}, {Scheme::order4, 400}, {Scheme::fourier, 101}}) {
    const auto got = multipliers(model, testing::kOleoSi, 2.0, 3.048, {scheme, points, true});
    EXPECT_NEAR(std::abs(got.multipliers[0] - reference.multipliers[0]), 0.0, 2e-5) << name(scheme);
  }
}

// The node between a spring and a damper has no mass: x'' + k (x - w) = f, c w' = k (x - w).
TEST(Floquet, GivesAMasslessCoordinateOneMultiplier) {
  config::ModelSpec spec =
      testing::model_of({testing::effect("linear_stiffness"), testing::effect("viscous_damping"),
                         testing::effect("linear_stiffness")});
  spec.coordinates = {"stroke", "node"};
  spec.mass = {1.0, 0.0, 0.0, 0.0};
  spec.excitation = {1.0, 0.0};
  spec.observed = "stroke";
  spec.effects[0].sees = {1.0, -1.0};
  spec.effects[0].acts = {1.0, -1.0};
  spec.effects[1].sees = {0.0, 1.0};
  spec.effects[1].acts = {0.0, 1.0};
  spec.effects[2].sees = {1.0, 0.0};
  spec.effects[2].acts = {1.0, 0.0};
  const Model model(spec);
  const double k = 50.0, c = 2.0, k0 = 20.0, f = 3.0;
  const Floquet got = multipliers(model, {k, c, k0}, f, 1.0, {Scheme::order6, 96, true});
  ASSERT_EQ(got.multipliers.size(), 3u);
  Eigen::MatrixXd a(3, 3);
  a << 0, 1, 0, -(k + k0), 0, k, k / c, 0, -k / c;
  const Eigen::VectorXcd exponents = a.eigenvalues();
  for (int i = 0; i < 3; ++i) {
    double nearest = 1.0;
    for (const Complex& m : got.multipliers)
      nearest = std::min(nearest, std::abs(m - std::exp(exponents[i] / f)));
    EXPECT_LT(nearest, 1e-9);
  }
}

// Two coordinates with velocity reversals in the orifice, by Odeint: the columns of the
// monodromy matrix are differences of whole periods from disturbed starts.
TEST(Floquet, OfTheOleoOnItsTyreIsWhatDisturbedPeriodsShow) {
  const double ratio = 0.15;
  const Model model(testing::oleo_on_tyre(ratio));
  std::vector<double> theta = testing::kOleoSi;
  theta.insert(theta.end(), {400.0, 1.5});
  const double f = 2.0, amplitude = 2.0;
  PeriodicSystem system(model, {Scheme::order6, 960, true});
  system.set_excitation(f, amplitude);
  ASSERT_EQ(system.solve_from_rest(theta).status, SolveStatus::converged);
  const auto got = floquet(system, theta);
  ASSERT_TRUE(got.ok());
  ASSERT_EQ(got->multipliers.size(), 4u);

  using TyreState = std::array<double, 4>;  // stroke, tyre, their velocities
  const auto rhs = [&](const TyreState& y, TyreState& d, double t) {
    const double x = amplitude * std::cos(2 * std::numbers::pi * f * t);
    const double strut =
        theta[0] * std::fabs(y[2]) * y[2] + theta[1] * std::pow(1 - theta[2] * y[0], -theta[3]);
    const double tyre = theta[4] * y[1] + theta[5] * y[3];
    const double g = 9.80665;
    // u'' + w'' = x + g - strut;  ratio w'' = ratio (x + g) + strut - tyre.
    const double w = (ratio * (x + g) + strut - tyre) / ratio;
    d = {y[2], y[3], x + g - strut - w, w};
  };
  const auto period = [&](TyreState y) {
    namespace odeint = boost::numeric::odeint;
    odeint::integrate_adaptive(
        odeint::make_controlled<odeint::runge_kutta_dopri5<TyreState>>(1e-12, 1e-12), rhs, y, 0.0,
        1.0 / f, 1e-4);
    return y;
  };
  const TyreState start = {system.value(0, 0), system.value(0, 1), system.velocity(0, 0),
                           system.velocity(0, 1)};
  Eigen::MatrixXd monodromy(4, 4);
  for (int k = 0; k < 4; ++k) {
    TyreState up = start, down = start;
    const double h = 1e-5;
    up[k] += h;
    down[k] -= h;
    const TyreState a = period(up), b = period(down);
    for (int i = 0; i < 4; ++i)
      monodromy(i, k) = (a[i] - b[i]) / (2 * h);
  }
  const Eigen::VectorXcd expected = monodromy.eigenvalues();
  for (int k = 0; k < 4; ++k) {
    double nearest = 1.0;
    for (const Complex& m : got->multipliers)
      nearest = std::min(nearest, std::abs(m - expected[k]));
    EXPECT_LT(nearest, 2e-5) << expected[k];
  }
}

TEST(Floquet, SaysWhenTheEquationsDoNotDetermineTheHighestDerivatives) {
  config::ModelSpec spec = testing::linear_oscillator();
  spec.coordinates = {"stroke", "idle"};
  spec.mass = {1.0, 0.0, 0.0, 0.0};
  spec.excitation = {1.0, 0.0};
  spec.observed = "stroke";
  for (auto& e : spec.effects)
    e.sees = e.acts = {1.0, 0.0};
  const Model model(spec);
  PeriodicSystem system(model, {Scheme::order4, 32, true});
  system.set_excitation(1.0, 1.0);
  const std::vector<double> theta = {0.5, 20.0};
  ASSERT_TRUE(system.linearise(theta));
  const auto got = floquet(system, theta);
  ASSERT_FALSE(got.ok());
  EXPECT_THAT(got.error().what, ::testing::HasSubstr("stability"));
}

}  // namespace
}  // namespace shaker::estimator
