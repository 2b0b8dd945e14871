// A damper on a dynamometer behind a joint that yields: the stroke is measured over both. The forces
// come from small explicit steps, and of a linear damper from its complex stiffness.
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/diagnosis/estimate_campaign.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::Contains;
using ::testing::Field;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kStiffness = 60.0, kDamping = 8.0;  // of the damper, 1/s^2 and 1/s
constexpr double kJoint = 2000.0;                    // 1/s^2

struct Dwell {
  double frequency_hz, amplitude;
};
constexpr Dwell kDwells[] = {{0.7, 0.02}, {1.3, 0.03}, {4.1, 0.015}, {7.9, 0.01}};

Recording named(std::size_t number) {
  Recording run;
  run.name = "r" + std::to_string(number);
  run.kind = Kind::imposed_motion;
  return run;
}

Recording sine(const Dwell& dwell, std::size_t number) {
  std::mt19937_64 source(number);
  std::normal_distribution<double> noise(0.0, 0.004);
  Recording run = named(number);
  run.frequency_hz = dwell.frequency_hz;
  const double omega = kTwoPi * dwell.frequency_hz;
  const std::complex<double> damper(kStiffness, omega * kDamping);
  const std::complex<double> both = damper * kJoint / (damper + kJoint);
  for (int i = 0; i < static_cast<int>(16.0 * 400.0 / dwell.frequency_hz); ++i) {
    const std::complex<double> turn = std::polar(dwell.amplitude, omega * i / 400.0);
    run.t.push_back(i / 400.0);
    run.displacement.push_back(turn.real());
    run.force.push_back((both * turn).real() + noise(source));
  }
  return run;
}

// Sweeps through a damper with an orifice: its speed under a load solves a quadratic equation.
Recording sweep(double orifice, double amplitude, std::size_t number) {
  std::mt19937_64 source(number);
  std::normal_distribution<double> noise(0.0, 0.01);
  Recording run = named(number);
  constexpr int kSteps = 200;
  constexpr double kRate = 400.0, kStep = 1.0 / kRate / kSteps;
  const auto stroke = [&](double t) {
    return amplitude * std::sin(kTwoPi * (0.5 + 0.6 * t) * t) * std::fmin(1.0, t / 0.5);
  };
  double own = 0.0;  // stroke of the damper
  for (int i = 0; i < static_cast<int>(6.0 * kRate); ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const double load = kJoint * (stroke(i / kRate + j * kStep) - own);
      if (j == 0) {
        run.t.push_back(i / kRate);
        run.displacement.push_back(stroke(i / kRate));
        run.force.push_back(load + noise(source));
      }
      const double moving = std::fabs(load - kStiffness * own);
      const double speed =
          2.0 * moving / (kDamping + std::sqrt(kDamping * kDamping + 4.0 * orifice * moving));
      own += kStep * std::copysign(speed, load - kStiffness * own);
    }
  }
  return run;
}

Campaign sines() {
  Campaign campaign;
  for (const Dwell& dwell : kDwells)
    campaign.runs.push_back(sine(dwell, campaign.runs.size() + 1));
  return campaign;
}

const NamedEffect* effect_of(const Diagnosis& d, const std::string& name) {
  for (const NamedEffect& named : d.effects) {
    if (named.name == name) return &named;
  }
  return nullptr;
}

TEST(JointOfDynamometer, IsNamedAndIsNoPlay) {
  const auto d = diagnose(sines(), estimator::testing::linear_oscillator());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  ASSERT_EQ(d->effects.size(), 1U);
  EXPECT_EQ(d->effects[0].name, "series_compliance");
  const ParameterEstimate& joint = d->effects[0].parameters.at(0);
  EXPECT_NEAR(joint.value, kJoint, 4.0 * joint.standard_error);
  EXPECT_LT(joint.standard_error, 0.01 * kJoint);
}

TEST(JointOfDynamometer, IsEstimatedWhereTheModelHasIt) {
  config::ModelSpec model = estimator::testing::linear_oscillator();
  model.effects.push_back(estimator::testing::effect("series_compliance"));
  const auto e = estimate_campaign(sines(), model);
  ASSERT_TRUE(e) << e.error().what;
  EXPECT_TRUE(e->intervals_hold);
  const double truth[] = {kDamping, kStiffness, kJoint};
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(e->parameters.at(k).value, truth[k], 4.0 * e->parameters[k].standard_error) << k;
}

TEST(JointOfDynamometer, IsNamedBesideAnOrificeAlongSweeps) {
  constexpr double kOrifice = 40.0;
  Campaign campaign;
  for (const double amplitude : {0.03, 0.02, 0.012})
    campaign.runs.push_back(sweep(kOrifice, amplitude, campaign.runs.size() + 1));
  const auto d = diagnose(campaign, estimator::testing::linear_oscillator());
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_EQ(d->verdict, Verdict::explained);
  const NamedEffect *joint = effect_of(*d, "series_compliance"),
                    *orifice = effect_of(*d, "orifice_damping");
  ASSERT_TRUE(joint != nullptr && orifice != nullptr);
  EXPECT_EQ(d->effects.size(), 2U);
  EXPECT_NEAR(joint->parameters.at(0).value, kJoint, 0.01 * kJoint);
  EXPECT_NEAR(orifice->parameters.at(0).value, kOrifice, 0.01 * kOrifice);
}

// A load path has one part in series.
TEST(JointOfDynamometer, IsNotTriedBesideAPlay) {
  config::ModelSpec model = estimator::testing::linear_oscillator();
  model.effects.push_back(estimator::testing::effect("free_play"));
  const auto d = diagnose(sines(), model);
  ASSERT_TRUE(d) << d.error().what;
  EXPECT_THAT(d->not_tried,
              Contains(AllOf(Field(&NotTried::name, "series_compliance"),
                             Field(&NotTried::reason,
                                   "the model has a play or a joint in its load path already"))));
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
