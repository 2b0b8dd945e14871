// Time integration against closed forms, results of other methods, and itself with other
// settings.
#include "estimator/solve/time/integration.hpp"

#include <cmath>
#include <complex>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using ::testing::HasSubstr;
using namespace testing;

constexpr double kFoot = 0.3048;

std::vector<double> even_times(double from, double to, int steps) {
  std::vector<double> t;
  for (int i = 0; i <= steps; ++i)
    t.push_back(from + (to - from) * i / steps);
  return t;
}

struct Run {
  std::vector<double> times;
  Arc arc;
  IntegrationReport report;
};

Run run(const StateEquations& equations, std::vector<double> times, std::vector<double> start,
        const Excitation& excitation, const std::vector<double>& theta, TimeOptions options = {},
        bool sensitivities = true) {
  std::vector<int> free;
  for (int k = 0; k < equations.parameters(); ++k)
    free.push_back(k);
  Run out;
  out.times = std::move(times);
  out.arc.times = out.times;
  out.arc.excitation = &excitation;
  out.arc.start = std::move(start);
  const auto integration = TimeIntegration::make(equations, options, free);
  out.report = integration->run({&out.arc, 1}, theta, sensitivities);
  out.arc.excitation = nullptr;
  return out;
}

// (6.2) in closed form for complex arguments, so that complex steps give its derivatives.
std::complex<double> free_decay(double t, std::complex<double> u0, std::complex<double> v0,
                                std::complex<double> c, std::complex<double> k) {
  const auto omega = std::sqrt(k - 0.25 * c * c);
  return std::exp(-0.5 * c * t) *
         (u0 * std::cos(omega * t) + (v0 + 0.5 * c * u0) / omega * std::sin(omega * t));
}

TimeOptions with(Integrator integrator, Gradient gradient = Gradient::sensitivities) {
  TimeOptions options;
  options.integrator = integrator;
  options.gradient = gradient;
  if (integrator == Integrator::runge_kutta4 || integrator == Integrator::sdirk4)
    options.step = 2e-3;
  return options;
}

class EveryIntegrator : public ::testing::TestWithParam<Integrator> {};

TEST_P(EveryIntegrator, FollowsTheLinearOscillatorAndItsSensitivities) {
  const Model model(linear_oscillator());
  const StateEquations equations(model);
  const std::vector<double> theta = {0.25, 7.5};
  const Excitation none;
  const auto result =
      run(equations, even_times(0.0, 4.0, 40), {1.0, 0.3}, none, theta, with(GetParam()));
  ASSERT_TRUE(result.report.ok) << result.report.sentence();
  const double h = 1e-30;
  for (std::size_t i = 0; i < result.times.size(); ++i) {
    const double t = result.times[i];
    EXPECT_NEAR(result.arc.states[2 * i], free_decay(t, 1.0, 0.3, 0.25, 7.5).real(), 1e-8);
    for (std::size_t k = 0; k < 4; ++k) {
      std::complex<double> x[4] = {1.0, 0.3, 0.25, 7.5};
      x[k] += std::complex<double>(0.0, h);
      const double exact = free_decay(t, x[0], x[1], x[2], x[3]).imag() / h;
      EXPECT_NEAR(result.arc.sensitivities[2 * i * 4 + k], exact, 2e-8) << "t " << t << " k " << k;
    }
  }
}

TEST_P(EveryIntegrator, ComesBackToItsPeriodicStateAfterOnePeriod) {
  // Independent reference states of the oleo in SI units (two methods agree to eight digits).
  struct Row {
    double f, a, u, v, low, high;
  };
  const Row rows[] = {{2, 3.048, 0.17366052, 0.09943985, 0.141812, 0.174319},
                      {2, 1.524, 0.16727874, 0.01596628, 0.150640, 0.167331},
                      {1, 3.048, 0.16137094, 0.06608927, 0.140573, 0.169672},
                      {2, 10.0, 0.12465722, 0.89644, 0.063441, 0.184512}};
  const Model model(oleo());
  const StateEquations equations(model);
  for (const Row& row : rows) {
    const auto result = run(equations, even_times(0.0, 1.0 / row.f, 400), {row.u, row.v},
                            Excitation::cosine(row.a, row.f), kOleoSi, with(GetParam()), false);
    ASSERT_TRUE(result.report.ok) << result.report.sentence();
    const auto& s = result.arc.states;
    EXPECT_NEAR(s[s.size() - 2], row.u, 2e-7);
    EXPECT_NEAR(s[s.size() - 1], row.v, row.a == 10.0 ? 5e-5 : 2e-7);
    double low = 1.0, high = 0.0;
    for (std::size_t i = 0; i < s.size(); i += 2) {
      low = std::min(low, s[i]);
      high = std::max(high, s[i]);
    }
    EXPECT_NEAR(low, row.low, 2e-6);
    EXPECT_NEAR(high, row.high, 4e-6);
  }
}

TEST_P(EveryIntegrator, SensitivitiesOfTwoCoordinatesAreTheDerivatives) {
  const Model model(oleo_on_tyre(0.1));
  const StateEquations equations(model);
  ASSERT_EQ(equations.states(), 4);
  const std::vector<double> theta = {5.08 / kFoot, 5.0 * kFoot, 1.62 / kFoot, 1.0, 1500.0, 4.0};
  const auto excitation = Excitation::cosine(2.0, 1.5);
  const auto times = even_times(0.0, 0.5, 50);
  const auto exact =
      run(equations, times, {0.1, 0.005, 0.2, -0.1}, excitation, theta, with(GetParam()));
  const auto differences = run(equations, times, {0.1, 0.005, 0.2, -0.1}, excitation, theta,
                               with(GetParam(), Gradient::finite_differences));
  ASSERT_TRUE(exact.report.ok && differences.report.ok) << exact.report.sentence();
  ASSERT_EQ(exact.arc.sensitivities.size(), differences.arc.sensitivities.size());
  for (std::size_t k = 0; k < 10; ++k) {
    double largest = 0.0, off = 0.0;
    for (std::size_t i = k; i < exact.arc.sensitivities.size(); i += 10) {
      largest = std::max(largest, std::fabs(exact.arc.sensitivities[i]));
      off = std::max(off, std::fabs(exact.arc.sensitivities[i] - differences.arc.sensitivities[i]));
    }
    EXPECT_LT(off, 1e-4 * largest) << "column " << k;
    EXPECT_GT(largest, 0.0);
  }
}

TEST_P(EveryIntegrator, RefusesAMotionThroughTheGasSpringsWall) {
  const Model model(oleo());
  const StateEquations equations(model);
  auto theta = kOleoSi;
  theta[0] = 0.0;   // no damping
  theta[1] = 1e-6;  // hardly any gas: nothing stops it before 1/theta3
  const auto result =
      run(equations, even_times(0.0, 0.5, 50), {0.1, 3.0}, Excitation(), theta, with(GetParam()));
  EXPECT_FALSE(result.report.ok);
  EXPECT_TRUE(result.report.inadmissible);
  EXPECT_LT(result.report.reached, 0.06);
  EXPECT_THAT(result.report.sentence(), HasSubstr("1/theta3"));
}

TEST_P(EveryIntegrator, RefusesAStartBeyondTheWall) {
  const Model model(oleo());
  const StateEquations equations(model);
  const auto result =
      run(equations, even_times(0.0, 0.5, 50), {0.2, 0.0}, Excitation(), kOleoSi, with(GetParam()));
  EXPECT_FALSE(result.report.ok);
  EXPECT_TRUE(result.report.inadmissible);
  EXPECT_EQ(result.report.reached, 0.0);
}

std::string integrator_name(const ::testing::TestParamInfo<Integrator>& which) {
  constexpr const char* kNames[] = {"adams", "bdf", "runge_kutta4", "sdirk4"};
  return kNames[static_cast<int>(which.param)];
}
INSTANTIATE_TEST_SUITE_P(Integrators, EveryIntegrator,
                         ::testing::Values(Integrator::adams, Integrator::bdf,
                                           Integrator::runge_kutta4, Integrator::sdirk4),
                         integrator_name);

// A decay with play in the joints. The stroke of the damper has no inertia: against a stop it
// follows within k / c = 25 us, and the samples are 20 ms apart.
TEST(Integration, TakesLongImplicitStepsThroughAStiffModel) {
  config::ModelSpec spec = linear_oscillator();
  spec.effects.push_back(effect("free_play"));
  const Model model(spec);
  const StateEquations equations(model);
  std::vector<double> theta = model.start();
  theta[0] = 0.5;
  theta[1] = 40.0;
  const std::vector<double> start = {0.05, 0.05, 0.0};
  ASSERT_EQ(equations.states(), 3);
  const auto times = even_times(0.0, 2.0, 100);
  TimeOptions exact = with(Integrator::bdf);
  exact.control_sensitivities = true;
  TimeOptions steps = with(Integrator::sdirk4);
  steps.step = 0.0;
  const auto reference = run(equations, times, start, Excitation(), theta, exact);
  const auto result = run(equations, times, start, Excitation(), theta, steps);
  ASSERT_TRUE(reference.report.ok) << reference.report.sentence();
  ASSERT_TRUE(result.report.ok) << result.report.sentence();
  const std::size_t columns = 3 + theta.size();
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_NEAR(result.arc.states[3 * i], reference.arc.states[3 * i], 1e-4) << times[i];
    for (std::size_t k = 3; k < 5; ++k) {  // over c and k
      const std::size_t at = 3 * i * columns + k;
      EXPECT_NEAR(result.arc.sensitivities[at], reference.arc.sensitivities[at], 1e-3) << times[i];
    }
  }
  steps.integrator = Integrator::runge_kutta4;
  const auto explosion = run(equations, times, start, Excitation(), theta, steps);
  EXPECT_FALSE(explosion.report.ok && std::fabs(explosion.arc.states.end()[-3]) < 1.0);
}

// A damping of 2000 1/s: the oscillator creeps back, and Adams needs steps of a thousandth of a second.
TEST(Integration, GoesOnWithBdfWhereAdamsTakesTooMuch) {
  const Model model(linear_oscillator());
  const StateEquations equations(model);
  const std::vector<double> theta = {2000.0, 1000.0};
  const double root = std::sqrt(1000.0 * 1000.0 - theta[1]);
  const double slow = -theta[1] / (1000.0 + root), fast = -1000.0 - root;
  for (const long most : {100000, 1000}) {
    TimeOptions options;
    options.max_evaluations = most;
    const auto result =
        run(equations, even_times(0.0, 2.0, 20), {1.0, 0.0}, Excitation(), theta, options, false);
    ASSERT_TRUE(result.report.ok);
    EXPECT_EQ(result.report.stiff, most == 1000);
    for (std::size_t i = 0; i < result.times.size(); ++i) {
      const double t = result.times[i];
      const double exact = (fast * std::exp(slow * t) - slow * std::exp(fast * t)) / (fast - slow);
      EXPECT_NEAR(result.arc.states[2 * i], exact, 1e-7);
    }
  }
}

// What runs away is stopped on the way, and not at its end.
TEST(Integration, StopsWhereItIsNotAffordedAnyLonger) {
  const Model model(linear_oscillator());
  const StateEquations equations(model);
  const auto times = even_times(0.0, 10.0, 1000);
  for (const Integrator integrator : {Integrator::runge_kutta4, Integrator::sdirk4}) {
    TimeOptions options = with(integrator);
    double spent = 0.0;
    options.afford = [&](double numbers) {
      spent += numbers;
      return true;
    };
    const auto whole = run(equations, times, {0.1, 0.0}, Excitation(), {0.25, 7.5}, options);
    ASSERT_TRUE(whole.report.ok) << whole.report.sentence();
    const double all = spent;
    ASSERT_GT(all, 5000.0 * 4.0 * 2.0) << "steps, stages, states";
    spent = 0.0;
    options.afford = [&](double numbers) {
      spent += numbers;
      return spent < 0.3 * all;
    };
    const auto part = run(equations, times, {0.1, 0.0}, Excitation(), {0.25, 7.5}, options);
    EXPECT_FALSE(part.report.ok);
    EXPECT_TRUE(part.report.stopped);
    EXPECT_FALSE(part.report.inadmissible);
    EXPECT_NEAR(part.report.reached, 3.0, 0.05);
    EXPECT_THAT(part.report.sentence(), HasSubstr("was stopped at t = "));
    EXPECT_LT(spent, 0.31 * all);
  }
}

TEST(Integration, DropsAsTheIndependentCodeDoes) {
  std::ifstream file(std::filesystem::path(SHAKER_TEST_DATA) / "verbeek1991.json");
  const auto rows = nlohmann::json::parse(file).at("drop");
  ASSERT_EQ(rows.size(), 10U);
  for (const auto& row : rows) {
    auto spec = oleo(32.174);
    const Model model(spec);
    const StateEquations equations(model);
    const double t_peak = row.at("t_peak");
    const auto result =
        run(equations, {0.0, t_peak}, {0.0, row.at("v0")}, Excitation(), row.at("theta"));
    ASSERT_TRUE(result.report.ok);
    EXPECT_NEAR(result.arc.states[2], row.at("peak_stroke").get<double>(), 1e-8);
    EXPECT_NEAR(result.arc.states[3], 0.0, 1e-6);
  }
}

TEST(Integration, AugmentedStatesGiveTheSameSensitivities) {
  const Model model(oleo());
  const StateEquations equations(model);
  const auto excitation = Excitation::cosine(3.048, 2.0);
  for (const Integrator kind : {Integrator::adams, Integrator::bdf}) {
    auto options = with(kind);
    options.control_sensitivities = true;
    const auto plain =
        run(equations, even_times(0.0, 0.5, 20), {0.1, 0.0}, excitation, kOleoSi, options);
    options.gradient = Gradient::augmented_states;
    const auto augmented =
        run(equations, even_times(0.0, 0.5, 20), {0.1, 0.0}, excitation, kOleoSi, options);
    ASSERT_TRUE(plain.report.ok && augmented.report.ok);
    ASSERT_EQ(plain.arc.sensitivities.size(), augmented.arc.sensitivities.size());
    double worst = 0.0;
    for (std::size_t i = 0; i < plain.arc.sensitivities.size(); ++i)
      worst =
          std::max(worst, std::fabs(plain.arc.sensitivities[i] - augmented.arc.sensitivities[i]) /
                              (1.0 + std::fabs(plain.arc.sensitivities[i])));
    EXPECT_LT(worst, 2e-7);
  }
}

// The error at the end against a much finer integration: at fourth order it falls by 16 when
// the step is halved; at the reversals of |v| v only when the steps end there.
double halving_gains(CutAtReversals cut) {
  const Model model(oleo());
  const StateEquations equations(model);
  const auto excitation = Excitation::cosine(3.048, 2.0);
  const auto error = [&](int steps) {
    TimeOptions options;
    options.relative_tolerance = 1e-13;
    options.absolute_tolerance = 1e-15;
    const auto exact =
        run(equations, even_times(0.0, 1.1, 110), {0.1, 0.0}, excitation, kOleoSi, options, false);
    options.integrator = Integrator::runge_kutta4;
    options.cut = cut;
    options.step = 1.1 / steps;
    const auto coarse =
        run(equations, even_times(0.0, 1.1, 110), {0.1, 0.0}, excitation, kOleoSi, options, false);
    double worst = 0.0;
    for (std::size_t i = 0; i < exact.arc.states.size(); ++i)
      worst = std::max(worst, std::fabs(coarse.arc.states[i] - exact.arc.states[i]));
    return worst;
  };
  return std::pow(error(220) / error(1760), 1.0 / 3.0);
}

TEST(Integration, RungeKuttaHasItsOrderWhenStepsAreCutAtReversals) {
  EXPECT_NEAR(halving_gains(CutAtReversals::always), 16.0, 1.5);
  EXPECT_LT(halving_gains(CutAtReversals::never), 13.0);
}

TEST(Integration, ManyArcsAbreastAreAsEachAlone) {
  const Model model(oleo());
  const StateEquations equations(model);
  std::vector<Excitation> excitations;
  std::vector<std::vector<double>> times;
  std::vector<Arc> arcs;
  for (int i = 0; i < 5; ++i) {
    excitations.push_back(Excitation::cosine(1.0 + i, 1.0 + 0.3 * i));
    times.push_back(even_times(0.1 * i, 1.0 + 0.1 * i, 90 + 17 * i));
  }
  for (std::size_t i = 0; i < 5; ++i) {
    Arc arc;
    arc.times = times[i];
    arc.excitation = &excitations[i];
    arc.start = {0.1 + 0.01 * static_cast<double>(i), 0.05 * static_cast<double>(i)};
    arcs.push_back(arc);
  }
  const auto integration =
      TimeIntegration::make(equations, with(Integrator::runge_kutta4), {0, 1, 2, 3});
  ASSERT_TRUE(integration->run(arcs, kOleoSi, true).ok);
  for (std::size_t i = 0; i < 5; ++i) {
    Arc alone;
    alone.times = times[i];
    alone.excitation = &excitations[i];
    alone.start = arcs[i].start;
    ASSERT_TRUE(integration->run({&alone, 1}, kOleoSi, true).ok);
    ASSERT_EQ(alone.states.size(), arcs[i].states.size());
    for (std::size_t k = 0; k < alone.states.size(); ++k)
      ASSERT_NEAR(alone.states[k], arcs[i].states[k], 1e-6);
    for (std::size_t k = 0; k < alone.sensitivities.size(); ++k)
      ASSERT_NEAR(alone.sensitivities[k], arcs[i].sensitivities[k], 1e-5);
  }
}

TEST(Excitation, InterpolatesCubicsExactly) {
  const auto cubic = [](double t) { return 1.0 - 2.0 * t + 0.5 * t * t + 3.0 * t * t * t; };
  std::vector<double> even, uneven, x, y;
  for (int i = 0; i < 12; ++i) {
    even.push_back(0.1 * i);
    uneven.push_back(0.1 * i + 0.03 * std::sin(i));
    x.push_back(cubic(even.back()));
    y.push_back(cubic(uneven.back()));
  }
  const auto a = Excitation::sampled(even, x), b = Excitation::sampled(uneven, y);
  for (double t = 0.02; t < 1.05; t += 0.037) {
    EXPECT_NEAR(a.value(t), cubic(t), 1e-12);
    EXPECT_NEAR(b.value(t), cubic(t), 1e-12);
  }
  EXPECT_EQ(a.value(-1.0), x.front());
  EXPECT_EQ(a.value(9.0), x.back());
}

TEST(Integration, SaysWhatItCannotDo) {
  const Model model(oleo());
  const StateEquations equations(model);
  TimeOptions options;
  options.integrator = Integrator::runge_kutta4;
  options.gradient = Gradient::augmented_states;
  EXPECT_THROW(TimeIntegration::make(equations, options, {}), std::invalid_argument);
  EXPECT_THROW(TimeIntegration::make(equations, {}, {7}), std::invalid_argument);
  EXPECT_THROW(StateEquations(model, {0.0, 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace shaker::estimator
