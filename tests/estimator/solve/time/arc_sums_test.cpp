// Sums of arcs against what the same integration keeps.
#include <cmath>

#include <gtest/gtest.h>

#include "estimator/solve/time/integration.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator {
namespace {

using namespace testing;

std::vector<double> times_between(double from, double to, int steps) {
  std::vector<double> t;
  for (int i = 0; i <= steps; ++i)
    t.push_back(from + (to - from) * i / steps);
  return t;
}

// Products of the rows that run() keeps.
std::vector<double> products_of(const Arc& arc, std::size_t m, std::size_t k, std::size_t apart) {
  std::vector<double> sum((k + 1) * (k + 1), 0.0);
  for (std::size_t i = 0; i < arc.measured.size(); ++i) {
    const std::size_t node = arc.first_measured + i;
    if (node % apart != 0) continue;
    std::vector<double> row(
        arc.sensitivities.begin() + static_cast<std::ptrdiff_t>(node * m * k),
        arc.sensitivities.begin() + static_cast<std::ptrdiff_t>(node * m * k + k));
    row.push_back(arc.measured[i] - arc.states[node * m]);
    for (std::size_t r = 0; r <= k; ++r) {
      for (std::size_t c = 0; c <= k; ++c)
        sum[r * (k + 1) + c] += row[r] * row[c];
    }
  }
  return sum;
}

struct Compared {
  std::vector<std::vector<double>> times;
  std::vector<Excitation> excitations;
  std::vector<double> measured;
  std::vector<Arc> arcs;

  explicit Compared(std::size_t states) : measured(120, 0.16) {
    for (int i = 0; i < 35; ++i) {  // more than one batch holds, of three lengths
      excitations.push_back(Excitation::cosine(1.0 + 0.1 * i, 1.0 + 0.1 * i));
      times.push_back(
          times_between(0.1 * i, 0.1 * i + 1e-3 * (64 + 8 * (i % 3)), 64 + 8 * (i % 3)));
    }
    for (std::size_t i = 0; i < times.size(); ++i) {
      Arc arc;
      arc.times = times[i];
      arc.excitation = &excitations[i];
      arc.start.assign(states, 0.01);
      arc.start[0] = 0.15;
      arc.first_measured = i % 2;
      arc.measured = std::span(measured).first(times[i].size() - 1 - i % 2);
      arcs.push_back(arc);
    }
  }
};

void expect_near_all(const double* got, const std::vector<double>& expected, double share) {
  for (std::size_t i = 0; i < expected.size(); ++i)
    ASSERT_NEAR(got[i], expected[i], share * (1e-3 + std::fabs(expected[i]))) << i;
}

class EverySum : public ::testing::TestWithParam<Integrator> {};

TEST_P(EverySum, IsOfWhatIsKept) {
  const Model model(oleo());
  const StateEquations equations(model);
  Compared compared(2);
  TimeOptions options;
  options.integrator = GetParam();
  const auto integration = TimeIntegration::make(equations, options, {0, 1, 2, 3});
  ASSERT_TRUE(integration->run(compared.arcs, kOleoSi, true).ok);
  ArcSums sums;
  ASSERT_TRUE(integration->sums(compared.arcs, kOleoSi, {}, sums).ok);
  for (std::size_t a = 0; a < compared.arcs.size(); ++a) {
    const Arc& arc = compared.arcs[a];
    expect_near_all(sums.end(a), {arc.states.end() - 2, arc.states.end()}, 1e-12);
    expect_near_all(sums.derivatives(a), {arc.sensitivities.end() - 12, arc.sensitivities.end()},
                    1e-12);
    expect_near_all(sums.products(a), products_of(arc, 2, 6, 1), 1e-12);
  }
}

// Steps of four samples: the same as the samples alone, and nearly the same with all between.
TEST(ArcSums, OverStridesAgreeWithThoseOfAllSamples) {
  const Model model(oleo_on_tyre(0.1));
  const StateEquations equations(model);
  const std::vector<double> theta = {16.7, 1.5, 5.3, 1.0, 400.0, 6.0};
  Compared compared(4);
  TimeOptions options;
  options.integrator = Integrator::runge_kutta4;
  const auto integration = TimeIntegration::make(equations, options, {0, 1, 2, 3, 4, 5});
  ASSERT_TRUE(integration->run(compared.arcs, theta, true).ok);
  ArcSums some, all;
  ASSERT_TRUE(integration->sums(compared.arcs, theta, {4, false, true}, some).ok);
  ASSERT_TRUE(integration->sums(compared.arcs, theta, {4, true, true}, all).ok);
  for (std::size_t a = 0; a < compared.arcs.size(); ++a) {
    const Arc& arc = compared.arcs[a];
    const auto fine = products_of(arc, 4, 10, 4), finest = products_of(arc, 4, 10, 1);
    for (std::size_t i = 0; i <= 10; ++i) {
      const std::size_t own = 11 * i + i;
      EXPECT_NEAR(some.products(a)[own], fine[own], 2e-2 * fine[own]) << i;
      EXPECT_NEAR(all.products(a)[own], finest[own], 2e-2 * finest[own]) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, EverySum,
                         ::testing::Values(Integrator::adams, Integrator::bdf,
                                           Integrator::runge_kutta4, Integrator::sdirk4));

}  // namespace
}  // namespace shaker::estimator
