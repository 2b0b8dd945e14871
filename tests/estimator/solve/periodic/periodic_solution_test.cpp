#include <algorithm>
#include <cmath>
#include <complex>
#include <fstream>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "estimator/solve/periodic/periodic_system.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using testing::kOleoFeet;
using testing::kOleoSi;

// --- linear oscillator: the periodic solution is known in closed form
double linear_error(Scheme scheme, int points) {
  const Model model(testing::linear_oscillator());
  const std::vector<double> theta = {2.0, 300.0};
  PeriodicSystem system(model, {scheme, points, true});
  // Several harmonics, so that every scheme has an error.
  std::vector<double> x(64);
  for (int i = 0; i < 64; ++i) {
    const double tau = 2.0 * std::numbers::pi * i / 64;
    x[i] = 3.0 * std::cos(tau) + 1.5 * std::sin(2.0 * tau) - 0.7 * std::cos(3.0 * tau);
  }
  system.set_excitation(2.0, x, 8);
  EXPECT_EQ(system.solve_from_rest(theta).status, SolveStatus::converged);
  const auto response = [&](int harmonic, std::complex<double> force, double tau) {
    const std::complex<double> iw(0.0, 2.0 * std::numbers::pi * 2.0 * harmonic);
    const auto u = force / (iw * iw + theta[0] * iw + theta[1]);
    return (u * std::polar(1.0, harmonic * tau)).real();
  };
  double worst = 0.0;
  for (int i = 0; i < points; ++i) {
    const double tau = 2.0 * std::numbers::pi * i / points;
    const double exact =
        response(1, 3.0, tau) + response(2, {0.0, -1.5}, tau) + response(3, -0.7, tau);
    worst = std::max(worst, std::fabs(system.value(i, 0) - exact));
  }
  return worst;
}

TEST(PeriodicSystem, HasTheDeclaredOrderOnASmoothProblem) {
  const auto order = [](Scheme scheme, int n) {
    return std::log2(linear_error(scheme, n) / linear_error(scheme, 2 * n));
  };
  EXPECT_NEAR(order(Scheme::order2, 128), 2.0, 0.05);
  EXPECT_NEAR(order(Scheme::order4, 128), 4.0, 0.05);
  EXPECT_NEAR(order(Scheme::order6, 64), 6.0, 0.15);
  EXPECT_LT(linear_error(Scheme::fourier, 16), 1e-14);
}

// At a stroke of -1e11 m the gas force has vanished and gravity alone is left. It is smaller
// than the rounding errors of differences of such a stroke.
TEST(PeriodicSystem, TakesNoStrokeForASolutionWhereTheEquationsDrownInRounding) {
  const Model model(testing::oleo());
  const std::vector<double> theta = {0.1, 20.0, 0.5, 1.0};
  PeriodicSystem system(model, {Scheme::order6, 80, true});
  system.set_excitation(2.0, 3.048);
  for (const double far : {-1e9, -1e11, -1e13}) {
    std::fill(system.state().begin(), system.state().end(), far);
    system.begin();
    const bool converged = system.solve(theta).status == SolveStatus::converged;
    EXPECT_FALSE(converged && std::fabs(system.value(0, 0)) > 100.0) << far;
  }
}

// --- the oleo against independent numbers
double stroke_error(Scheme scheme, int points, bool correct_reversals) {
  const auto reference = testing::read_csv("oleo_j4_reference.csv", false);
  const Model model(testing::oleo(32.2));
  PeriodicSystem system(model, {scheme, points, correct_reversals});
  system.set_excitation(2.0, 10.0);
  EXPECT_EQ(system.solve_from_rest(kOleoFeet).status, SolveStatus::converged);
  double worst = 0.0;
  for (int i = 0; i < 40; ++i)
    worst = std::max(worst, std::fabs(system.value(i * points / 40, 0) - reference[i][0]));
  return worst;
}

TEST(PeriodicSystem, FindsTheOleosSolutionToTheGridsAccuracy) {
  EXPECT_LT(stroke_error(Scheme::order6, 160, true), 1e-9);
  EXPECT_LT(stroke_error(Scheme::order6, 640, true), 2e-12);
  EXPECT_LT(stroke_error(Scheme::fourier, 120, false), 1e-6);
}

// v|v limits plain grids to about third order; the correction of the jump of u'''' restores their
// order.
TEST(PeriodicSystem, LosesItsOrderToTheKinkUnlessItIsCorrected) {
  const auto order = [](Scheme scheme, bool correct) {
    return std::log2(stroke_error(scheme, 80, correct) / stroke_error(scheme, 640, correct)) / 3.0;
  };
  EXPECT_NEAR(order(Scheme::order6, false), 3.0, 0.6);
  EXPECT_NEAR(order(Scheme::order4, true), 4.0, 0.3);
  EXPECT_GT(order(Scheme::order6, true), 4.3);
}

// Largest error of each sensitivity, relative to the largest value of its column.
double sensitivity_error(int points, bool correct_reversals) {
  const auto reference = testing::read_csv("oleo_j4_reference.csv", false);
  const Model model(testing::oleo(32.2));
  PeriodicSystem system(model, {Scheme::order6, points, correct_reversals});
  system.set_excitation(2.0, 10.0);
  EXPECT_EQ(system.solve_from_rest(kOleoFeet).status, SolveStatus::converged);
  double worst = 0.0;
  for (int k = 1; k <= 4; ++k) {
    double size = 0.0;
    double error = 0.0;
    for (int i = 0; i < 40; ++i) {
      size = std::max(size, std::fabs(reference[i][k]));
      error = std::max(error, std::fabs(system.row(i * points / 40, 0)[k] - reference[i][k]));
    }
    worst = std::max(worst, error / size);
  }
  return worst;
}

TEST(PeriodicSystem, GivesTheSensitivitiesOfTheReference) {
  EXPECT_LT(sensitivity_error(120, true), 4e-7);
  EXPECT_LT(sensitivity_error(640, true), 5e-11);
}

// The third derivative of the sensitivities jumps with the sign of the velocity.
TEST(PeriodicSystem, KeepsTheOrderOfTheSensitivitiesAcrossTheKink) {
  const auto order = [](bool correct) {
    return std::log2(sensitivity_error(80, correct) / sensitivity_error(320, correct)) / 2.0;
  };
  EXPECT_LT(order(false), 3.0);
  EXPECT_NEAR(order(true), 6.0, 0.3);
}

TEST(PeriodicSystem, ReachesTheReferenceStatesInSi) {
  struct ReferenceRow {
    double f, a, u0, v0, low, high;
  };
  const ReferenceRow rows[] = {{2, 3.048, 0.17366052, 0.09943985, 0.141812, 0.174319},
                               {2, 1.524, 0.16727874, 0.01596628, 0.150640, 0.167331},
                               {1, 3.048, 0.16137094, 0.06608927, 0.140573, 0.169672},
                               {2, 10.0, 0.12465722, 0.89644, 0.063441, 0.184512}};
  const Model model(testing::oleo());
  for (const ReferenceRow& r : rows) {
    PeriodicSystem system(model, {Scheme::order6, 1024, true});
    system.set_excitation(r.f, r.a);
    ASSERT_EQ(system.solve_from_rest(kOleoSi).status, SolveStatus::converged);
    EXPECT_NEAR(system.value(0, 0), r.u0, 6e-9);
    EXPECT_NEAR(system.velocity(0, 0), r.v0, 6e-7 * std::max(1.0, 10 * r.v0));
    double low = 1.0, high = -1.0;
    for (int i = 0; i < 1024; ++i) {
      low = std::min(low, system.value(i, 0));
      high = std::max(high, system.value(i, 0));
    }
    EXPECT_NEAR(low, r.low, 2e-6);
    EXPECT_NEAR(high, r.high, 2e-6);
  }
}

TEST(PeriodicSystem, AgreesWithTheAccurateSolutionsOfThePapersExcitations) {
  std::ifstream file(SHAKER_TEST_DATA "/verbeek1991.json");
  const auto data = nlohmann::json::parse(file);
  for (const auto& p : data["periodic"]) {
    const Model model(testing::oleo(p["grav"]));
    PeriodicSystem fine(model, {Scheme::order6, 640, true});
    fine.set_excitation(p["f"], p["amp"]);
    ASSERT_EQ(fine.solve_from_rest(kOleoFeet).status, SolveStatus::converged);
    PeriodicSystem coarse(model, {Scheme::order2, 40, false});
    coarse.set_excitation(p["f"], p["amp"]);
    ASSERT_EQ(coarse.solve_from_rest(kOleoFeet).status, SolveStatus::converged);
    for (int i = 0; i < 40; ++i) {
      EXPECT_NEAR(fine.value(16 * i, 0), std::stod(p["u_accurate"][i].get<std::string>()), 2e-10);
      EXPECT_NEAR(coarse.value(i, 0), std::stod(p["u_fd2"][i].get<std::string>()), 1e-9);
    }
  }
}

// --- several coordinates
TEST(PeriodicSystem, SolvesALinearChainOfTwoMassesAsItsFrequencyResponse) {
  auto spec = testing::oleo_on_tyre(0.1);
  spec.effects[0] = testing::effect("viscous_damping");   // in place of the orifice
  spec.effects[1] = testing::effect("linear_stiffness");  // in place of the gas
  spec.effects[2] = testing::effect("gravity");
  for (int k = 0; k < 3; ++k) {
    spec.effects[k].sees = {1.0, 0.0};
    spec.effects[k].acts = {1.0, k == 2 ? 0.1 : -1.0};
  }
  const Model model(spec);
  const std::vector<double> theta = {3.0, 60.0, 900.0, 2.0};  // c1, k1, k2, c2
  PeriodicSystem system(model, {Scheme::fourier, 16, false});
  system.set_excitation(2.0, 4.0);
  ASSERT_EQ(system.solve_from_rest(theta).status, SolveStatus::converged);
  using C = std::complex<double>;
  const C iw(0.0, 4.0 * std::numbers::pi);
  const C s2 = iw * iw;
  // u1'' + u2'' + c1 u1' + k1 u1 = x;  m u2'' + c2 u2' + k2 u2 - c1 u1' - k1 u1 = m x
  const C link = 3.0 * iw + 60.0;
  const C a11 = s2 + link, a12 = s2, a21 = -link, a22 = 0.1 * s2 + 2.0 * iw + 900.0;
  const C det = a11 * a22 - a12 * a21;
  const C u1 = (4.0 * a22 - a12 * 0.4) / det, u2 = (a11 * 0.4 - a21 * 4.0) / det;
  const double rest2 = (9.80665 + 0.1 * 9.80665) / 900.0, rest1 = 9.80665 / 60.0;
  for (int i = 0; i < 16; ++i) {
    const C turn = std::polar(1.0, 2.0 * std::numbers::pi * i / 16);
    EXPECT_NEAR(system.value(i, 0), rest1 + (u1 * turn).real(), 1e-12);
    EXPECT_NEAR(system.value(i, 1), rest2 + (u2 * turn).real(), 1e-12);
  }
}

TEST(PeriodicSystem, HasSensitivitiesOfTheOleoOnItsTyreThatMatchDifferences) {
  const Model model(testing::oleo_on_tyre(0.1));
  const std::vector<double> theta = {16.6667, 1.524, 5.31496, 1.0, 2000.0, 3.0};
  const auto solved = [&](const std::vector<double>& at) {
    auto system = std::make_unique<PeriodicSystem>(model, GridOptions{Scheme::order4, 128, false});
    system->set_excitation(2.0, 3.048);
    EXPECT_EQ(system->solve_from_rest(at).status, SolveStatus::converged);
    return system;
  };
  const auto base = solved(theta);
  for (std::size_t k = 0; k < theta.size(); ++k) {
    auto up = theta, down = theta;
    const double h = 1e-5 * theta[k];
    up[k] += h;
    down[k] -= h;
    const auto above = solved(up), below = solved(down);
    double scale = 1e-9;
    for (int i = 0; i < 128; ++i)
      scale = std::max(scale, std::fabs(base->row(i, 0)[1 + k]));
    for (int i = 0; i < 128; i += 7) {
      for (int c = 0; c < 2; ++c)
        EXPECT_NEAR(base->row(i, c)[1 + k], (above->value(i, c) - below->value(i, c)) / (2 * h),
                    2e-6 * scale)
            << "theta " << k;
    }
  }
}

// --- what has no solution is reported
TEST(PeriodicSystem, SaysHowFarTheContinuationGotWhenThereIsNoSolution) {
  // Without a spring nothing carries the weight.
  const Model model(
      testing::model_of({testing::effect("orifice_damping"), testing::effect("gravity")}));
  PeriodicSystem system(model, {Scheme::order4, 64, true});
  system.set_excitation(2.0, 3.0);
  const SolveReport report = system.solve_from_rest(std::vector<double>{10.0});
  EXPECT_EQ(report.status, SolveStatus::no_equilibrium);
  EXPECT_NE(report.sentence().find("static equilibrium"), std::string::npos);
}

TEST(PeriodicSystem, NeverCrossesTheGasWallHoweverStrongTheExcitation) {
  const Model model(testing::oleo());
  for (const double amplitude : {3.0, 10.0, 30.0, 60.0}) {
    PeriodicSystem system(model, {Scheme::order4, 256, true});
    system.set_excitation(1.0, amplitude);
    const SolveReport report = system.solve_from_rest(kOleoSi);
    if (report.status != SolveStatus::converged) {
      EXPECT_GT(report.amplitude_reached, 0.0);
      EXPECT_NE(report.sentence().find("%"), std::string::npos);
      continue;
    }
    for (int i = 0; i < 256; ++i)
      EXPECT_LT(kOleoSi[2] * system.value(i, 0), 1.0);
  }
}

// With exactly as many steps as it needs, the search must converge.
TEST(PeriodicSystem, HasArrivedByTheLastStepThatItMayTake) {
  const Model model(testing::oleo());
  PeriodicSystem system(model, {Scheme::order6, 128, true});
  system.set_excitation(2.0, 3.0);
  ASSERT_EQ(system.solve_from_rest(kOleoSi).status, SolveStatus::converged);
  const std::vector<double> solution(system.state().begin(), system.state().end());
  const auto from_aside = [&](int most) {
    system.begin();
    for (std::size_t i = 0; i < solution.size(); ++i)
      system.state()[i] = 1.05 * solution[i];
    return system.solve(kOleoSi, most);
  };
  const SolveReport free = from_aside(30);
  ASSERT_EQ(free.status, SolveStatus::converged);
  ASSERT_GT(free.iterations, 2);
  EXPECT_EQ(from_aside(free.iterations).status, SolveStatus::converged);
  EXPECT_EQ(from_aside(free.iterations - 1).status, SolveStatus::no_convergence);
}

TEST(PeriodicSystem, GivesUpFromRestAfterAsManyStepsAsItMayTake) {
  const Model model(testing::oleo());
  PeriodicSystem system(model, {Scheme::order4, 256, true});
  system.set_excitation(1.0, 60.0);
  const SolveReport free = system.solve_from_rest(kOleoSi);
  const SolveReport brief = system.solve_from_rest(kOleoSi, PeriodicSystem::kTolerance, 5);
  EXPECT_GT(free.iterations, brief.iterations);
  EXPECT_EQ(brief.status, SolveStatus::no_convergence);
  EXPECT_LT(brief.amplitude_reached, 1.0);
}

TEST(PeriodicSystem, KeepsItsSolutionAndItsChannelsAtRest) {
  const Model model(testing::oleo());
  PeriodicSystem system(model, {Scheme::order6, 128, true});
  system.set_excitation(2.0, 3.0);
  const Quantity channels[] = {Quantity::displacement, Quantity::damper_force};
  system.set_channels(channels);
  ASSERT_EQ(system.solve_from_rest(kOleoSi).status, SolveStatus::converged);
  const std::vector<double> state(system.state().begin(), system.state().end());
  const double load = system.observed(17, 1);
  system.rest();
  const PeriodicSystem another = system.anew();
  EXPECT_TRUE(std::equal(state.begin(), state.end(), another.state().begin()));
  EXPECT_EQ(another.frequency(), 2.0);
  const SolveReport again = system.solve(kOleoSi);
  EXPECT_EQ(again.status, SolveStatus::converged);
  // The corrections at velocity reversals have been reset.
  EXPECT_LE(again.iterations, 2);
  EXPECT_NEAR(system.observed(17, 0), state[17], 1e-9);
  EXPECT_NEAR(system.observed(17, 1), load, 1e-9 * std::fabs(load));
}

TEST(PeriodicSystem, RefusesAGridThatIsTooCoarse) {
  const Model model(testing::oleo());
  EXPECT_THROW(PeriodicSystem(model, {Scheme::order6, 8, true}), std::invalid_argument);
}

}  // namespace
}  // namespace shaker::estimator
