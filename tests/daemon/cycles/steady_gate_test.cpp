#include "daemon/cycles/steady_gate.hpp"

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "daemon/cycles/cycle_noise.hpp"

namespace shaker::daemon {
namespace {

constexpr std::size_t kPoints = 64;
constexpr double kNoise = 7e-6;

class Cycles {
 public:
  explicit Cycles(unsigned seed) : random_(seed) {}
  // extra(k, tau), m, is added to a steady stroke of 20 mm amplitude.
  std::vector<double> next(const std::function<double(int, double)>& extra, double noise = kNoise) {
    std::vector<double> u(kPoints);
    for (std::size_t i = 0; i < kPoints; ++i) {
      const double tau = static_cast<double>(i) / kPoints;
      u[i] = 0.15 + 0.02 * std::cos(2 * std::numbers::pi * tau) + extra(k_, tau) +
             noise * normal_(random_);
    }
    ++k_;
    return u;
  }
  int count() const { return k_; }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  int k_ = 0;
};

double nothing(int, double) {
  return 0.0;
}

TEST(SteadyGate, HoldsBackAtMostOneSteadyCycleInTwoHundred) {
  int held = 0, seen = 0;
  double change = 0.0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Cycles cycles(seed);
    SteadyGate gate;
    gate.restart(kPoints, 3.0);
    for (int k = 0; k < 200; ++k) {
      const auto verdict = gate.add(cycles.next(nothing), kNoise);
      if (k < 7) continue;
      ++seen;
      change += verdict.change;
      if (!verdict.steady) ++held;
    }
  }
  EXPECT_LT(held, seen / 200);
  EXPECT_NEAR(change / seen, 1.0, 0.03);  // "about 1 when steady"
}

TEST(SteadyGate, LetsASlowTransientThroughOnlyWhenLittleIsLeft) {
  double worst = 0.0, mean = 0.0;
  constexpr int kTrials = 40;
  for (unsigned seed = 1; seed <= kTrials; ++seed) {
    Cycles cycles(seed);
    SteadyGate gate;
    gate.restart(kPoints, 3.0);
    const auto transient = [](int k, double tau) {
      return 0.005 * std::exp(-0.105 * k) * std::cos(2 * std::numbers::pi * tau + 1.0);
    };
    while (!gate.add(cycles.next(transient), kNoise).steady)
      ASSERT_LT(cycles.count(), 300);
    const double left = 0.005 * std::exp(-0.105 * (cycles.count() - 1)) / std::sqrt(2.0) / kNoise;
    worst = std::max(worst, left);
    mean += left / kTrials;
  }
  EXPECT_LT(worst, 1.5);
  EXPECT_LT(mean, 1.0);
  RecordProperty("left_of_the_transient_in_noise", std::to_string(mean));
}

TEST(SteadyGate, ComparesFromTheSecondCycleOn) {
  Cycles cycles(3);
  SteadyGate gate;
  gate.restart(kPoints, 3.0);
  EXPECT_EQ(gate.add(cycles.next(nothing), kNoise).change, 0.0);
  EXPECT_NEAR(gate.add(cycles.next(nothing), kNoise).change, 1.0, 0.3);
}

// Each cycle lies 0.2 of a point's noise above the one before: 7 steps of it in a window of 8.
TEST(SteadyGate, MeasuresACreepOverItsWindow) {
  Cycles cycles(3);
  SteadyGate gate;
  gate.restart(kPoints, 3.0);
  const auto creep = [](int k, double) { return 0.2 * kNoise * k; };
  GateVerdict verdict;
  for (int k = 0; k < 12; ++k)
    verdict = gate.add(cycles.next(creep, 0.02 * kNoise), kNoise);
  EXPECT_FALSE(verdict.steady);
  EXPECT_NEAR(verdict.creep, 7 * 0.2, 0.01);
}

// A tenth of the tolerance over the window, of 7 steps.
TEST(SteadyGate, LetsACreepPassThatIsBelowATenthOfTheTolerance) {
  for (const double step : {0.035, 0.05}) {  // times 7: 0.245 and 0.35; a tenth is 0.3
    Cycles cycles(3);
    SteadyGate gate;
    gate.restart(kPoints, 3.0);
    const auto creep = [&](int k, double) { return step * kNoise * k; };
    GateVerdict verdict;
    for (int k = 0; k < 12; ++k)
      verdict = gate.add(cycles.next(creep, 0.002 * kNoise), kNoise);
    EXPECT_EQ(verdict.steady, step < 0.04) << verdict.why;
  }
}

TEST(SteadyGate, AFastTransientCostsOnlyTheCyclesThatMustBeSeen) {
  Cycles cycles(3);
  SteadyGate gate;
  gate.restart(kPoints, 3.0);
  const auto transient = [](int k, double) { return 0.03 * std::pow(0.1, k); };
  while (!gate.add(cycles.next(transient), kNoise).steady)
    ASSERT_LT(cycles.count(), 20);
  EXPECT_LE(cycles.count(), 16);
}

TEST(SteadyGate, ANoiselessSensorSettlesToo) {
  Cycles cycles(3);
  SteadyGate gate;
  gate.restart(kPoints, 3.0);
  const auto transient = [](int k, double) { return 0.03 * std::pow(0.3, k); };
  while (!gate.add(cycles.next(transient, 0.0), 0.0).steady)
    ASSERT_LT(cycles.count(), 40);
}

TEST(SteadyGate, NamesAResponseThatRepeatsOnlyEverySecondOrThirdPeriod) {
  for (const int p : {2, 3, 4}) {
    Cycles cycles(11);
    SteadyGate gate;
    gate.restart(kPoints, 3.0);
    const auto sub = [p](int k, double tau) {
      return 0.002 * std::cos(2 * std::numbers::pi * (k + tau) / p);
    };
    for (int k = 0; k < 30; ++k) {
      const auto verdict = gate.add(cycles.next(sub), kNoise);
      EXPECT_FALSE(verdict.steady) << k;
      if (k < 7) continue;
      ASSERT_TRUE(verdict.subharmonic.has_value()) << p << " " << k;
      EXPECT_EQ(*verdict.subharmonic, p);
    }
  }
}

TEST(SteadyGate, HardlyEverCallsARandomWanderSteadyAndNeverSubharmonic) {
  Cycles cycles(5);
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  SteadyGate gate;
  gate.restart(kPoints, 3.0);
  double level = 0.0;
  int steady = 0;
  for (int k = 0; k < 1000; ++k) {
    level = 1e-4 * normal(random);
    const auto verdict = gate.add(cycles.next([&](int, double) { return level; }), kNoise);
    if (verdict.steady) ++steady;
    EXPECT_FALSE(verdict.subharmonic.has_value()) << k;
  }
  EXPECT_LE(steady, 5);
}

TEST(SteadyGate, AGapCostsOneCycleWhereTheResponseIsTheSameBeforeAndAfter) {
  Cycles cycles(3);
  SteadyGate gate;
  gate.restart(kPoints, 3.0);
  for (int k = 0; k < 12; ++k)
    (void)gate.add(cycles.next(nothing), kNoise);
  for (int missing = 1; missing <= SteadyGate::kMissingMost; ++missing) {
    for (int k = 0; k < missing; ++k)
      gate.interrupt();
    EXPECT_TRUE(gate.add(cycles.next(nothing), kNoise).steady) << missing;
  }
}

TEST(SteadyGate, ASuccessionBeginsAnewAfterALongGapOrAnotherResponse) {
  for (const bool other : {false, true}) {
    Cycles cycles(3);
    SteadyGate gate;
    gate.restart(kPoints, 3.0);
    for (int k = 0; k < 12; ++k)
      (void)gate.add(cycles.next(nothing), kNoise);
    for (int k = 0; k < (other ? 1 : 3); ++k)
      gate.interrupt();
    const auto shift = [&](int, double) { return other ? 8.0 * kNoise : 0.0; };
    for (int k = 0; k < 7; ++k) {
      EXPECT_FALSE(gate.add(cycles.next(shift), kNoise).steady);
    }
    EXPECT_TRUE(gate.add(cycles.next(shift), kNoise).steady);
  }
}

TEST(SteadyGate, AGapDoesNotPassASubharmonicAsSteady) {
  Cycles cycles(5);
  SteadyGate gate;
  gate.restart(kPoints, 3.0);
  const auto second = [](int k, double) { return k % 2 == 0 ? 6.0 * kNoise : -6.0 * kNoise; };
  for (int k = 0; k < 40; ++k) {
    const auto cycle = cycles.next(second);
    if (k % 7 == 6) {
      gate.interrupt();  // the parity changes with every gap
    } else {
      EXPECT_FALSE(gate.add(cycle, kNoise).steady) << k;
    }
  }
}

TEST(CycleNoise, KnowsWhatWandersTogether) {
  // The amplitudes of the first two harmonics vary together; the second by half as much and in
  // the opposite direction.
  Cycles cycles(21);
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  CycleNoise noise;
  noise.restart(kPoints);
  for (int k = 0; k < 2000; ++k) {
    const double swing = 1e-4 * normal(random);
    noise.add(cycles.next([&](int, double tau) {
      const double turn = 2 * std::numbers::pi * tau;
      return swing * std::cos(turn) + (0.005 - 0.5 * swing) * std::sin(2 * turn);
    }));
  }
  const auto all = noise.covariance();
  EXPECT_NEAR(all[1][1] / 1e-8, 1.0, 0.1);
  EXPECT_NEAR(all[1][3] / -0.5e-8, 1.0, 0.1);
  EXPECT_NEAR(all[1][3] / all[3][1], 1.0, 1e-9);
  EXPECT_NEAR(all[3][3] / 0.25e-8, 1.0, 0.1);
  EXPECT_LT(std::abs(all[4][4]), 1e-11) << "the second harmonic's phase stands";
  EXPECT_EQ(noise.covariance(2).along, all[3][3]);
}

TEST(CycleNoise, HasACovarianceThatIsTheSameBothWays) {
  Cycles cycles(21);
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  CycleNoise noise;
  noise.restart(kPoints);
  CycleNoise swings;  // of the swing itself
  swings.restart(8);
  for (int k = 0; k < 100; ++k) {
    const double swing = 1e-4 * normal(random);
    swings.add(std::vector<double>(8, swing));
    noise.add(cycles.next([&](int, double tau) {
      double all = swing;  // the mean goes with every harmonic, each of another phase
      for (int h = 1; h <= 4; ++h) {
        const double turn = 2 * std::numbers::pi * h * tau;
        all += (0.005 + swing) * std::cos(turn + h);
      }
      return all;
    }));
  }
  const auto all = noise.covariance();
  for (std::size_t i = 0; i < CycleNoise::kCoefficients; ++i) {
    for (std::size_t k = 0; k < i; ++k)
      EXPECT_NEAR(all[i][k], all[k][i], 1e-12) << i << " " << k;
  }
  const double variance = std::pow(swings.point_standard_deviation(), 2);
  EXPECT_NEAR(all[0][3] / variance, 1.0, 0.02) << "the mean and the amplitude of a harmonic";
}

TEST(CycleNoise, LooksAtNoPointBeyondTheCycle) {
  Cycles cycles(21);
  CycleNoise noise;
  noise.restart(kPoints);
  for (int k = 0; k < 200; ++k) {
    auto cycle = cycles.next(nothing);
    cycle.push_back(k % 2 == 0 ? 1.0 : -1.0);  // not its own
    noise.add(std::span(cycle).first(kPoints));
  }
  EXPECT_NEAR(noise.point_standard_deviation() / kNoise, 1.0, 0.05);
}

TEST(CycleNoise, NamesNoPartThatIsLargerThanTheWhole) {
  CycleNoise noise;
  noise.restart(8);
  const std::vector<double> low(8, 1.0), high(8, 1.002);
  EXPECT_EQ(repeatability(noise, 0.5), "one alone does not tell how well they repeat");
  noise.add(low);
  EXPECT_EQ(repeatability(noise, 0.5), "one alone does not tell how well they repeat");
  noise.add(high);  // standard deviation 1.41e-3 m
  EXPECT_EQ(repeatability(noise, 1e-3),
            "a point differs from cycle to cycle by 1.41e-03 m, of which the sensor's own noise is "
            "1.00e-03 m");
  EXPECT_EQ(repeatability(noise, 1.5e-3),
            "they repeat as well as the sensor can tell: a point differs from cycle to cycle by "
            "1.41e-03 m");
}

TEST(CycleNoise, FindsTheScatterOfPointsAndTellsPhaseFromAmplitude) {
  Cycles cycles(21);
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  CycleNoise noise;
  noise.restart(kPoints);
  for (int k = 0; k < 2000; ++k)
    noise.add(cycles.next(nothing));
  EXPECT_NEAR(noise.point_standard_deviation() / kNoise, 1.0, 0.02);
  EXPECT_NEAR(noise.covariance(1).along / (kNoise * kNoise * 2 / kPoints), 1.0, 0.1);

  noise.restart(kPoints);
  double turn = 0.0;
  for (int k = 0; k < 500; ++k) {
    turn = 1e-3 * normal(random);
    noise.add(cycles.next([&](int, double tau) {
      return 0.02 *
             (std::cos(2 * std::numbers::pi * tau + turn) - std::cos(2 * std::numbers::pi * tau));
    }));
  }
  const auto c = noise.covariance(1);
  EXPECT_NEAR(std::sqrt(c.across) / 2e-5, 1.0, 0.1);  // 20 mm times 1 mrad
  EXPECT_LT(c.along, 0.01 * c.across);
}

}  // namespace
}  // namespace shaker::daemon
