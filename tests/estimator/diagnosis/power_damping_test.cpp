// Damping that follows a power of the velocity, on a dynamometer: a fluid that thins under shear.
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

Campaign dwells(const std::function<double(double, double)>& force, double noise_size,
                std::uint64_t seed = 0) {
  constexpr double kRate = 400.0, kCycles = 16.0;
  constexpr double kMotions[][2] = {{0.7, 0.02}, {1.3, 0.03}, {2.1, 0.015}, {2.9, 0.025}};
  Campaign campaign;
  for (const auto& [frequency_hz, amplitude] : kMotions) {
    std::mt19937_64 source(seed + campaign.runs.size() + 1);
    std::normal_distribution<double> noise(0.0, noise_size);
    Recording run;
    run.name = "r" + std::to_string(campaign.runs.size());
    run.kind = Kind::imposed_motion;
    run.frequency_hz = frequency_hz;
    const double omega = 2.0 * std::numbers::pi * frequency_hz;
    for (int i = 0; i < static_cast<int>(kCycles * kRate / frequency_hz); ++i) {
      const double t = i / kRate, u = amplitude * std::cos(omega * t);
      run.t.push_back(t);
      run.displacement.push_back(u);
      run.force.push_back(force(u, -amplitude * omega * std::sin(omega * t)) + noise(source));
    }
    campaign.runs.push_back(std::move(run));
  }
  return campaign;
}

config::ModelSpec spring() {
  config::ModelSpec model = estimator::testing::linear_oscillator();
  std::erase_if(model.effects, [](const auto& e) { return e.effect != "linear_stiffness"; });
  return model;
}

std::vector<std::string> names_in(const Diagnosis& d) {
  std::vector<std::string> names;
  for (const NamedEffect& effect : d.effects)
    names.push_back(effect.name);
  return names;
}

double power(double v, double alpha) {
  return std::copysign(std::pow(std::fabs(v) / 0.2, alpha), v);
}

TEST(PowerDamping, IsNamedAndNotFriction) {
  for (const double alpha : {0.4, 1.5}) {
    const auto d =
        diagnose(dwells([&](double u, double v) { return 60.0 * u + 5.0 * power(v, alpha); }, 0.1),
                 spring());
    ASSERT_TRUE(d) << d.error().what;
    ASSERT_THAT(names_in(*d), ::testing::ElementsAre("power_damping"));
    EXPECT_GT(d->effects[0].probability, 0.85);
    for (const ParameterEstimate& p : d->effects[0].parameters) {
      if (p.name == "alpha") {
        EXPECT_NEAR(p.value, alpha, 0.01);
      }
    }
  }
}

std::vector<std::string> named_beside_a_spring(const std::function<double(double)>& force,
                                               std::uint64_t seed) {
  const auto d = diagnose(
      dwells([&](double u, double v) { return 60.0 * u + force(v); }, 0.1, seed), spring());
  EXPECT_TRUE(d) << d.error().what;
  return d ? names_in(*d) : std::vector<std::string>();
}

// A richer law does not take the place of a simpler one that does as much, but by chance.
TEST(PowerDamping, GivesWayToDampingInProportion) {
  const std::vector<std::string> viscous = {"viscous_damping"};
  int times = 0;
  for (const std::uint64_t seed : {0, 10, 20})
    times += named_beside_a_spring([](double v) { return 25.0 * v; }, seed) == viscous ? 1 : 0;
  EXPECT_GE(times, 2);
}

TEST(PowerDamping, GivesWayToFriction) {
  EXPECT_THAT(named_beside_a_spring([](double v) { return 5.0 * std::tanh(v / 1e-3); }, 0),
              ::testing::ElementsAre(::testing::EndsWith("_friction")));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
