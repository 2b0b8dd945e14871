// Drops of the paper's oleo against independent numbers, and the two kinds of bands against
// each other.
#include "estimator/drop/drop.hpp"

#include <cmath>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "../fixtures.hpp"

namespace shaker::estimator {
namespace {

using namespace testing;

config::ModelSpec in_feet() {
  auto spec = oleo(32.174);
  spec.length_unit = "ft";
  return spec;
}

TEST(Drop, FiguresAreThoseOfTheIndependentCode) {
  std::ifstream file(SHAKER_TEST_DATA "/verbeek1991.json");
  const auto rows = nlohmann::json::parse(file).at("drop");
  for (const auto& row : rows) {
    const DropTest test(in_feet(), {row.at("v0"), 0.0, 1.5, -1});
    const auto run = test.run(row.at("theta"), false);
    ASSERT_TRUE(run.ok()) << run.error().what;
    EXPECT_NEAR(run->figures[figure_called("peak_stroke")], row.at("peak_stroke").get<double>(),
                2e-7);
    EXPECT_NEAR(run->figures[figure_called("time_of_peak_stroke")], row.at("t_peak").get<double>(),
                5e-5);
    EXPECT_NEAR(run->figures[figure_called("peak_deceleration")],
                -row.at("peak_decel").get<double>(), 5e-3);
    EXPECT_NEAR(run->figures[figure_called("load_at_peak_stroke")] - 32.174,
                -row.at("acc_at_peak_stroke").get<double>(), 2e-2);
    EXPECT_EQ(run->fastest, row.at("v0").get<double>());
  }
}

TEST(Drop, ThePeakLoadHasTheSlopesOfItsDifferences) {
  const DropTest test(in_feet(), {10.0, 0.5, 1.5, -1});
  const auto peak = test.peak_load(kOleoFeet);
  ASSERT_TRUE(peak.ok()) << peak.error().what;
  ASSERT_EQ(peak->derivatives.size(), kOleoFeet.size());
  for (std::size_t k = 0; k < kOleoFeet.size(); ++k) {
    std::vector<double> low = kOleoFeet, high = kOleoFeet;
    const double step = 1e-4 * kOleoFeet[k];
    low[k] -= step;
    high[k] += step;
    const double slope =
        (test.peak_load(high)->value - test.peak_load(low)->value) / (high[k] - low[k]);
    EXPECT_NEAR(peak->derivatives[k], slope, 1e-4 * peak->value / kOleoFeet[k]) << k;
  }
}

TEST(Drop, EnergyIsThatOfTheFall) {
  for (const double lift : {0.0, 0.5, 1.0}) {
    const DropTest test(in_feet(), {10.0, lift, 1.5, -1});
    const auto run = test.run(kOleoFeet, false);
    ASSERT_TRUE(run.ok()) << run.error().what;
    const double stroke = run->figures[figure_called("peak_stroke")];
    const double energy = 50.0 + (1.0 - lift) * 32.174 * stroke;
    EXPECT_NEAR(run->figures[figure_called("energy_absorbed")], energy, 2e-3);
    EXPECT_LT(run->figures[figure_called("energy_dissipated")], energy);
    // Lift carries weight: the load at touch-down is the same, the deceleration is larger by
    // the lift.
    EXPECT_NEAR(run->figures[figure_called("peak_load")], 513.0, 1e-9);
    EXPECT_NEAR(run->figures[figure_called("peak_deceleration")], 513.0 - (1.0 - lift) * 32.174,
                1e-9);
  }
}

TEST(Drop, TheTyreTakesTheFirstBlow) {
  const auto spec = oleo_on_tyre(0.1);
  const DropTest test(spec, {3.0, 0.0, 1.5, -1});
  const auto run = test.run({16.7, 1.5, 5.3, 1.0, 1500.0, 8.0}, false);
  ASSERT_TRUE(run.ok()) << run.error().what;
  EXPECT_EQ(run->history.speed[0], 0.0);
  const DropTest stiff(oleo(), {3.0, 0.0, 1.5, -1});
  const auto without = stiff.run({16.7, 1.5, 5.3, 1.0}, false);
  EXPECT_LT(run->figures[figure_called("peak_load")], without->figures[figure_called("peak_load")]);
  EXPECT_GT(run->figures[figure_called("peak_load")], 9.81);
}

// The effect `tyre` is the gear whose tyre is a coordinate of the model.
TEST(Drop, ATyreThatADiagnosisNamesFallsOnTheGround) {
  const double share = 0.1;
  auto named = oleo();
  config::EffectSpec line;
  line.effect = "tyre";
  line.parameters["r"].start = share;
  line.constants["g"] = named.gravity;
  named.effects.push_back(line);
  const DropConditions conditions{3.0, 0.3, 1.5, -1};
  const DropTest test(named, conditions), written(oleo_on_tyre(share), conditions);
  const std::vector<double> theta = {16.7, 1.5, 5.3, 1.0, share, 1500.0, 8.0};
  const std::vector<double> other = {16.7, 1.5, 5.3, 1.0, 1500.0, 8.0};
  // The push is an unnamed force of the strut, which acts on both masses.
  for (const double push : {0.0, -2.0}) {
    const auto run = test.run(theta, false, Excitation::constant(push));
    const auto same = written.run(other, false, Excitation::constant(push));
    ASSERT_TRUE(run.ok()) << run.error().what;
    ASSERT_TRUE(same.ok()) << same.error().what;
    for (std::size_t f = 0; f < kDropFigureCount; ++f)
      EXPECT_NEAR(run->figures[f], same->figures[f], 1e-6 * (1.0 + std::fabs(same->figures[f])))
          << kDropFigures[f].name << ", push " << push;
  }
  const auto shares = test.shares(theta);
  ASSERT_TRUE(shares.ok()) << shares.error().what;
  EXPECT_NEAR(shares->energy_residual, 0.0, 1e-6);
}

// Behind a part in series the damper has a stroke of its own: its effects carry the load that the joint
// transmits, and the joint keeps what it is bent by.
TEST(Drop, SharesOfADamperBehindAJointCloseTheBalance) {
  for (const bool play : {false, true}) {
    auto spec = oleo();
    config::EffectSpec joint;
    joint.effect = play ? "free_play" : "series_compliance";
    joint.in_series = !play;
    spec.effects.push_back(joint);
    spec.effects.push_back(effect("viscous_damping"));
    std::vector<double> theta = {16.7, 1.5, 5.3, 1.0};
    for (const double more :
         play ? std::vector<double>{1e-3, 3000.0, 5.0} : std::vector{3000.0, 5.0})
      theta.push_back(more);
    const DropTest test(spec, {3.0, 0.3, 1.5, -1});
    const auto run = test.run(theta, false);
    const auto shares = test.shares(theta);
    ASSERT_TRUE(run.ok()) << run.error().what;
    ASSERT_TRUE(shares.ok()) << shares.error().what;
    EXPECT_NEAR(shares->energy_residual, 0.0, 1e-6) << joint.effect;
    ASSERT_EQ(shares->effects.size(), 4U);
    double sum = 0.0;
    for (const EffectShare& share : shares->effects)
      sum += share.effect == joint.effect ? 0.0 : share.of_peak_load;
    EXPECT_NEAR(sum, 1.0, 1e-6);
    EXPECT_EQ(shares->effects.back().effect, joint.effect);
    EXPECT_NEAR(shares->effects.back().of_peak_load, 1.0, 1e-6);
    EXPECT_GT(shares->effects.back().of_energy, 1e-3);
  }
}

TEST(Drop, BandsByDeltaMethodAndSamplingAgreeWhereTheyAreNarrow) {
  const DropTest test(in_feet(), {10.0, 0.0, 1.0, -1});
  DropUncertainty uncertainty;
  uncertainty.parameters = {0, 1, 2, 3};
  uncertainty.covariance.assign(16, 0.0);
  const double error[] = {0.02, 0.03, 0.001, 0.005};
  for (std::size_t k = 0; k < 4; ++k)
    uncertainty.covariance[k * 5] = error[k] * error[k];
  uncertainty.degrees_of_freedom = 500.0;
  const auto prediction = predict_drop(test, kOleoFeet, uncertainty);
  ASSERT_TRUE(prediction.ok()) << prediction.error().what;
  EXPECT_EQ(prediction->samples, 400);
  EXPECT_EQ(prediction->lost, 0);
  // theta1 v0^2 + theta2 - g, with an error that is known in closed form.
  const auto& deceleration = prediction->bands[figure_called("peak_deceleration")];
  EXPECT_NEAR(deceleration.error, std::hypot(100.0 * 0.02, 0.03), 1e-4);
  for (const char* name : {"peak_stroke", "peak_deceleration", "energy_absorbed"}) {
    const auto& band = prediction->bands[figure_called(name)];
    const double width = band.upper - band.lower;
    EXPECT_NEAR(band.sampled_upper - band.sampled_lower, width, 0.2 * width) << name;
    EXPECT_LT(band.lower, band.value);
  }
  // The band of the history ends in the band of the figure.
  const auto& h = prediction->run.history;
  EXPECT_NEAR(h.load_error[0], deceleration.error, 1e-3);
  EXPECT_EQ(h.stroke_error[0], 0.0);
}

// A mass with an initial speed on a spring and a damper, in closed form.
struct FreeDecay {
  double speed, c, k;

  double damping() const { return 0.5 * c; }
  double pulse() const { return std::sqrt(k - damping() * damping()); }
  double turns_at() const { return std::atan2(pulse(), damping()) / pulse(); }
  double stroke(double t) const {
    return speed / pulse() * std::exp(-damping() * t) * std::sin(pulse() * t);
  }
  double peak() const { return stroke(turns_at()); }
};

TEST(Drop, OfTheLinearOscillatorIsItsClosedForm) {
  const double c = 3.0, k = 150.0, speed = 2.0;
  const FreeDecay exact{speed, c, k};
  const DropTest test(linear_oscillator(), {speed, 0.0, 1.5, -1});
  DropUncertainty uncertainty;
  uncertainty.parameters = {0, 1};
  uncertainty.covariance = {0.1 * 0.1, 0.5 * 0.1 * 2.0, 0.5 * 0.1 * 2.0, 2.0 * 2.0};
  uncertainty.degrees_of_freedom = 200.0;
  const auto prediction = predict_drop(test, {c, k}, uncertainty);
  ASSERT_TRUE(prediction.ok()) << prediction.error().what;
  const auto& run = prediction->run;
  EXPECT_NEAR(run.figures[figure_called("peak_stroke")], exact.peak(), 1e-6);
  EXPECT_NEAR(run.figures[figure_called("time_of_peak_stroke")], exact.turns_at(), 1e-5);
  EXPECT_NEAR(run.figures[figure_called("energy_absorbed")], 0.5 * speed * speed, 1e-4);
  for (std::size_t i = 0; i < run.history.t.size(); i += 50)
    EXPECT_NEAR(run.history.stroke[i], exact.stroke(run.history.t[i]), 1e-6);
  const double over_c = (FreeDecay{speed, c + 1e-4, k}.peak() - exact.peak()) / 1e-4;
  const double over_k = (FreeDecay{speed, c, k + 1e-3}.peak() - exact.peak()) / 1e-3;
  const double variance = std::pow(0.1 * over_c, 2) + std::pow(2.0 * over_k, 2) +
                          2.0 * 0.5 * 0.1 * 2.0 * over_c * over_k;
  EXPECT_NEAR(prediction->bands[figure_called("peak_stroke")].error, std::sqrt(variance),
              1e-3 * std::sqrt(variance));
}

TEST(Drop, RefusesWhatMakesNoSense) {
  EXPECT_THROW(DropTest(oleo(), {0.0, 0.0, 1.0, -1}), std::invalid_argument);
  EXPECT_THROW(DropTest(oleo(), {1.0, 1.5, 1.0, -1}), std::invalid_argument);
  EXPECT_THROW(DropTest(oleo(), {1.0, 0.0, 0.0, -1}), std::invalid_argument);
  EXPECT_THROW(DropTest(oleo(), {1.0, 0.0, 1.0, 3}), std::invalid_argument);
  const DropTest brief(oleo(), {3.0, 0.0, 0.01, -1});
  const auto run = brief.run(kOleoSi, false);
  ASSERT_FALSE(run.ok());
  EXPECT_THAT(run.error().what, ::testing::HasSubstr("longer duration"));
}

}  // namespace
}  // namespace shaker::estimator
