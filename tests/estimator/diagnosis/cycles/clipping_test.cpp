#include "estimator/diagnosis/cycles/internal/clipping.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimator/diagnosis/cycles/steady_cycles.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using ::testing::HasSubstr;

constexpr double kFrequency = 2.003, kRate = 101.7, kSeconds = 8.0;

double rounded(double value, double step) {
  return step * std::round(value / step);
}

// Over one turn, from -1 to 1: moves during the fraction `moving` of each half, smoothly if
// `eased`, and rests at the ends.
double resting(double turn, double moving, bool eased) {
  turn -= std::floor(turn);
  const double part = std::min(1.0, std::fmod(turn, 0.5) / 0.5 / moving);
  const double way = eased ? 1.0 - std::cos(0.5 * (2.0 * std::numbers::pi) * part) : 2.0 * part;
  return turn < 0.5 ? way - 1.0 : 1.0 - way;
}

using Curve = std::function<double(double turn)>;

Recording empty(Kind kind, double amplitude) {
  Recording r;
  r.name = "r1";
  r.kind = kind;
  r.frequency_hz = 2.0;
  r.amplitude = amplitude;
  for (int i = 0; i < static_cast<int>(kSeconds * kRate); ++i)
    r.t.push_back(i / kRate);
  return r;
}

Recording periodic(const Curve& displacement) {
  Recording r = empty(Kind::periodic, 3.0);
  std::mt19937_64 source(3);
  std::normal_distribution<double> normal;
  for (const double t : r.t) {
    r.excitation.push_back(3.0 * std::cos((2.0 * std::numbers::pi) * kFrequency * t) +
                           5e-3 * normal(source));
    r.displacement.push_back(displacement(kFrequency * t));
  }
  return r;
}

// The force of a damper of 20 1/s and a spring of 30 1/s^2.
Recording imposed(const Curve& motion) {
  Recording r = empty(Kind::imposed_motion, 0.03);
  std::mt19937_64 source(5);
  std::normal_distribution<double> normal;
  for (const double t : r.t) {
    const double turn = kFrequency * t, d = 1e-6;
    const double velocity = (motion(turn + d) - motion(turn - d)) / (2.0 * d) * kFrequency;
    r.displacement.push_back(rounded(motion(turn), 1e-6));
    r.force.push_back(20.0 * velocity + 30.0 * motion(turn) + 0.01 * normal(source));
  }
  return r;
}

TEST(Clipping, IsNotADynamometerThatHoldsItsEnds) {
  for (const bool eased : {true, false}) {
    const Recording r =
        imposed([&](double turn) { return 0.1 + 0.03 * resting(turn, 0.8, eased); });
    const auto run = steady_cycles(r);
    EXPECT_TRUE(run) << eased << ": " << run.error().what;
  }
}

TEST(Clipping, IsAnImposedMotionWhoseSensorHasMetItsEnd) {
  for (const double lost : {0.02, 0.1, 0.3}) {
    Recording r =
        imposed([](double turn) { return 0.1 + 0.03 * std::sin((2.0 * std::numbers::pi) * turn); });
    for (double& u : r.displacement)
      u = std::min(u, 0.13 - 0.06 * lost);
    const auto run = steady_cycles(r);
    ASSERT_FALSE(run) << lost;
    EXPECT_THAT(run.error().what, HasSubstr("the displacement stays on its highest value"));
  }
}

TEST(Clipping, IsNotADamperThatSticksForLongOnACoarseGrid) {
  for (const double step : {1e-4, 2e-4, 5e-4}) {
    for (const double moving : {0.4, 0.6, 0.8}) {
      std::mt19937_64 source(11);
      std::normal_distribution<double> normal(0.0, 0.1 * step);
      const auto run = steady_cycles(periodic([&](double turn) {
        return rounded(0.15 + 0.005 * resting(turn, moving, true) + normal(source), step);
      }));
      EXPECT_TRUE(run) << step << ", " << moving << ": " << run.error().what;
    }
  }
}

TEST(Clipping, IsNotAForceThatAValveCutsFlatWithinAStepOfACoarseGrid) {
  for (const double step : {0.01, 0.05}) {
    Recording r =
        imposed([](double turn) { return 0.1 + 0.03 * std::sin((2.0 * std::numbers::pi) * turn); });
    for (std::size_t i = 0; i < r.t.size(); ++i) {
      const double velocity = 0.03 * (2.0 * std::numbers::pi) * kFrequency *
                              std::cos((2.0 * std::numbers::pi) * kFrequency * r.t[i]);
      r.force[i] = rounded(std::clamp(20.0 * velocity, -2.5, 2.5), step);
    }
    const auto run = steady_cycles(r);
    EXPECT_TRUE(run) << step << ": " << run.error().what;
  }
}

// Noise moves the flanks of the signal but not its flat part.
TEST(Clipping, IsALoadCellWithoutNoiseOnlyWhereItIsFlat) {
  Recording r =
      imposed([](double turn) { return 0.1 + 0.03 * std::sin((2.0 * std::numbers::pi) * turn); });
  std::mt19937_64 source(9);
  std::normal_distribution<double> normal(0.0, 0.03);
  for (double& force : r.force)
    force = rounded(std::min(force + normal(source), 6.0), 0.01);
  const auto run = steady_cycles(r);
  ASSERT_FALSE(run);
  EXPECT_THAT(run.error().what, HasSubstr("the force stays on its highest value"));
}

TEST(Clipping, IsSeenUnderTheNoiseOfWhatComesAfterIt) {
  for (const double lost : {0.05, 0.1, 0.2}) {
    std::mt19937_64 source(13);
    std::normal_distribution<double> normal(0.0, 2e-6);
    const auto run = steady_cycles(periodic([&](double turn) {
      const double u = 0.15 + 0.025 * std::sin((2.0 * std::numbers::pi) * turn) +
                       0.004 * std::cos(2.0 * (2.0 * std::numbers::pi) * turn);
      return rounded(std::max(u, 0.1215 + 0.05 * lost) + normal(source), 1e-6);
    }));
    ASSERT_FALSE(run) << lost;
    EXPECT_THAT(run.error().what, HasSubstr("the displacement stays on its lowest value")) << lost;
  }
}

TEST(Clipping, IsSeenOnACoarseGrid) {
  for (const double step : {1e-4, 5e-4}) {
    for (const double lost : {0.1, 0.2}) {
      const auto run = steady_cycles(periodic([&](double turn) {
        return rounded(
            std::min(0.15 + 0.025 * std::sin((2.0 * std::numbers::pi) * turn), 0.175 - 0.05 * lost),
            step);
      }));
      ASSERT_FALSE(run) << step << ", " << lost;
      EXPECT_THAT(run.error().what, HasSubstr("the displacement stays on its highest value"));
    }
  }
}

TEST(Clipping, IsNotACrestUnderNoise) {
  for (const double noise : {1e-6, 2e-5, 1e-3}) {
    std::mt19937_64 source(17);
    std::normal_distribution<double> normal(0.0, noise);
    const auto run = steady_cycles(periodic([&](double turn) {
      return 0.15 + 0.025 * std::sin((2.0 * std::numbers::pi) * turn) +
             0.004 * std::cos(2.0 * (2.0 * std::numbers::pi) * turn) + normal(source);
    }));
    EXPECT_TRUE(run) << noise << ": " << run.error().what;
  }
}

}  // namespace
}  // namespace shaker::estimator::diagnosis
