// Engine, drivers, virtual rig and estimator together, in simulated time.
#include "daemon/simulated_campaign.hpp"

#include <cmath>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "drivers/sim/simulated_devices.hpp"
#include "tests/sanitized.hpp"

namespace shaker::daemon {
namespace {

using shaker::sim::Fault;

const config::RigConfig& example_rig() {
  static const auto rig =
      config::load_rig(std::string(SHAKER_SOURCE_DIR) + "/config/examples/rig-simulated.json")
          .value();
  return rig;
}
config::CampaignSpec example_campaign() {
  return config::load_campaign(std::string(SHAKER_SOURCE_DIR) +
                               "/config/examples/campaign-three-runs.json")
      .value();
}

template <class T>
std::vector<T> all(const SimulatedCampaign& campaign) {
  std::vector<T> found;
  for (const auto& d : campaign.documents) {
    if (const auto* one = std::get_if<T>(&d)) found.push_back(*one);
  }
  return found;
}

std::string summary(const SimulatedCampaign& campaign) {
  std::string text;
  for (const auto& d : campaign.documents) {
    if (const auto* a = std::get_if<protocol::AlarmDocument>(&d))
      text += a->code + ": " + a->text + "\n";
    if (const auto* s = std::get_if<protocol::RunStopDocument>(&d)) {
      text += s->run + " " + s->status + ": " + s->reason + "\n";
    }
  }
  return text;
}

TEST(SimulatedCampaign, ThreeDwellsGiveTheTruthWithinTheirIntervals) {
  auto rig = example_rig();
  auto& sensor = std::get<config::SimulatedSensor>(rig.sensors[0]);
  sensor.clock_offset_ppm = 200.0;
  sensor.jitter_fraction = 0.1;
  sensor.dropout_fraction = 0.01;
  const auto result = run_simulated_campaign(rig, example_campaign());
  ASSERT_TRUE(result.ok()) << result.error().what;
  ASSERT_EQ(result->final_state, State::idle) << summary(*result);
  EXPECT_EQ(summary(*result).find("polarity"), std::string::npos) << summary(*result);
  std::printf("%s", summary(*result).c_str());
  const auto stops = all<protocol::RunStopDocument>(*result);
  ASSERT_EQ(stops.size(), 3u) << summary(*result);
  for (const auto& stop : stops)
    EXPECT_EQ(stop.status, "success") << stop.reason;
  const auto estimates = all<protocol::EstimateDocument>(*result);
  ASSERT_EQ(estimates.size(), 70u);  // one for each accepted cycle
  ASSERT_EQ(result->accepted.size(), 70u);

  const std::map<std::string, double> truth{
      {"theta1", 16.6667}, {"theta2", 1.524}, {"theta3", 5.31496}, {"theta4", 1.0}};
  const auto& last = estimates.back();
  EXPECT_TRUE(last.usable) << ::testing::PrintToString(last.warnings);
  EXPECT_EQ(last.cycles_used, 70);
  EXPECT_EQ(last.runs_used, 3);
  EXPECT_EQ(*last.clock, "simulated");
  int found = 0;
  for (const auto& p : last.parameters) {
    const auto at = truth.find(p.name);
    if (at == truth.end()) continue;
    ++found;
    std::printf("%s %.6g +- %.2g, truth %.6g, %.2f sigma\n", p.name.c_str(), p.value,
                p.standard_error, at->second, (p.value - at->second) / p.standard_error);
    // Four parameters and a fixed seed: an error above four standard errors means a bias.
    EXPECT_LT(std::abs(p.value - at->second), 4.0 * p.standard_error) << p.name;
  }
  EXPECT_EQ(found, 4);
}

// Compares the errors of the whole chain (noise, clock, resampling, gate and fit) with its
// stated standard errors. The parameters are correlated, so 30 campaigns count little more than
// 30 draws.
struct Honesty {
  std::map<std::string, double> mean, rms;  // of the errors, in standard errors
};
Honesty honesty(double excitation_noise) {
  auto rig = example_rig();
  auto& sensor = std::get<config::SimulatedSensor>(rig.sensors[0]);
  sensor.clock_offset_ppm = 200.0;
  sensor.jitter_fraction = 0.1;
  sensor.dropout_fraction = 0.01;
  sensor.noise_m_s2 = excitation_noise;
  const std::map<std::string, double> truth{
      {"theta1", 16.6667}, {"theta2", 1.524}, {"theta3", 5.31496}, {"theta4", 1.0}};
  Honesty result;
  constexpr int kCampaigns = repetitions(30);
  for (int seed = 1; seed <= kCampaigns; ++seed) {
    sensor.seed = static_cast<std::uint64_t>(seed);
    const auto campaign = run_simulated_campaign(rig, example_campaign());
    const auto estimates = all<protocol::EstimateDocument>(campaign.value());
    for (const auto& p : estimates.back().parameters) {
      const auto at = truth.find(p.name);
      if (at == truth.end()) continue;
      const double z = (p.value - at->second) / p.standard_error;
      result.mean[p.name] += z / kCampaigns;
      result.rms[p.name] += z * z / kCampaigns;
    }
  }
  for (auto& [symbol, square] : result.rms) {
    square = std::sqrt(square);
    std::printf("%s: mean error %.2f, rms error %.2f standard errors\n", symbol.c_str(),
                result.mean[symbol], square);
  }
  return result;
}

TEST(SimulatedCampaign, StandardErrorsAreHonestWhereTheExcitationIsKnown) {
  const auto result = honesty(0.0);
  ASSERT_EQ(result.rms.size(), 4u);
  if (kSanitized) return;  // too few campaigns for the checks below
  for (const auto& [symbol, rms] : result.rms) {
    EXPECT_LT(std::abs(result.mean.at(symbol)), 0.75) << symbol;  // 4 errors of a mean of 30
    EXPECT_GT(rms, 0.65) << symbol;
    EXPECT_LT(rms, 1.4) << symbol;
  }
}

// The accelerometer's own noise has an effect as large as the stroke's noise, and the intervals
// include it (MeasuredCycle::excitation_error). Without it they would be too narrow by a factor
// of 1.6.
TEST(SimulatedCampaign, StandardErrorsAreHonestWhereTheExcitationIsNoisy) {
  const auto result = honesty(5e-3);
  ASSERT_EQ(result.rms.size(), 4u);
  if (kSanitized) return;  // too few campaigns for the checks below
  for (const auto& [symbol, rms] : result.rms) {
    EXPECT_LT(std::abs(result.mean.at(symbol)), 0.75) << symbol;
    EXPECT_GT(rms, 0.65) << symbol;
    EXPECT_LT(rms, 1.4) << symbol;
  }
}

TEST(SimulatedCampaign, MeasuresTheRigsOwnFrequency) {
  auto rig = example_rig();
  std::get<config::SimulatedSensor>(rig.sensors[0]).clock_offset_ppm = 200.0;
  auto campaign = example_campaign();
  campaign.runs.resize(1);
  const auto result = run_simulated_campaign(rig, campaign);
  ASSERT_TRUE(result.ok()) << result.error().what;
  ASSERT_FALSE(result->accepted.empty()) << summary(*result);
  EXPECT_NEAR(result->accepted.back().frequency_hz / 1.5, 1.0 + 200e-6, 3e-6);
}

// Faults of the rig, injected during the measurement or before the motion.
struct FaultCase {
  Fault fault;
  double at_s;
  std::string code;
  double stroke_min_m = 0.0;
};
class SimulatedFault : public ::testing::TestWithParam<FaultCase> {};

TEST_P(SimulatedFault, EndsTheCampaignWithItsAlarmAndTheTableAtRest) {
  auto rig_config = example_rig();
  rig_config.limits.stroke_min_m = GetParam().stroke_min_m;
  auto campaign = example_campaign();
  campaign.runs[0].cycles = 100;
  SimulatedClock clock;
  const auto& sensor = std::get<config::SimulatedSensor>(rig_config.sensors[0]);
  auto rig = drivers::sim::make_simulated_rig(sensor, {}, clock).value();
  drivers::Devices devices;
  devices.exciter = std::make_unique<drivers::sim::SimulatedExciter>(rig);
  devices.sensors.push_back(std::make_unique<drivers::sim::SimulatedSensor>(rig));
  SimulationOptions options;
  options.at_most_s = 120.0;
  bool injected = false;
  options.each_tick = [&](Engine&, double t) {
    if (!injected && t >= GetParam().at_s) {
      injected = true;
      rig->at_now([](auto& r) { r.inject(GetParam().fault); });
    }
  };
  const auto result = run_simulated_campaign(rig_config, campaign, options, devices, clock);
  ASSERT_TRUE(result.ok()) << result.error().what;
  const auto stops = all<protocol::RunStopDocument>(*result);
  ASSERT_EQ(stops.size(), 1u);
  EXPECT_EQ(stops[0].status, "fail");
  bool said = false;
  for (const auto& a : all<protocol::AlarmDocument>(*result))
    said = said || a.code == GetParam().code;
  EXPECT_TRUE(said) << summary(*result);
  // When the link is dead, the drive's own dead-man stops the table after its timeout.
  clock.advance(std::chrono::seconds(2));
  EXPECT_FALSE(rig->at_now([](auto& r) { return r.status().running; }));
}

INSTANTIATE_TEST_SUITE_P(All, SimulatedFault,
                         ::testing::Values(FaultCase{Fault::sensor_silent, 0.2, "check_sensor"},
                                           FaultCase{Fault::sensor_nan, 0.2, "check_sensor"},
                                           FaultCase{Fault::exciter_silent, 0.2, "check_exciter"},
                                           FaultCase{Fault::sensor_inverted, 0.2, "stroke_limit"},
                                           FaultCase{Fault::sensor_inverted, 0.05, "polarity",
                                                     -0.3},
                                           FaultCase{Fault::sensor_frozen, 0.2, "frozen_sensor"},
                                           FaultCase{Fault::sensor_silent, 20.0, "stale_sensor"},
                                           FaultCase{Fault::sensor_nan, 20.0, "stale_sensor"},
                                           FaultCase{Fault::sensor_frozen, 20.0, "frozen_sensor"},
                                           FaultCase{Fault::sensor_inverted, 20.0, "stroke_limit"},
                                           FaultCase{Fault::exciter_trip, 20.0, "exciter_trip"},
                                           FaultCase{Fault::exciter_silent, 20.0, "exciter_error"}),
                         [](const auto& one) {
                           return "fault" + std::to_string(static_cast<int>(one.param.fault)) +
                                  (one.param.at_s < 1.0 ? "_at_rest_" : "_in_motion_") +
                                  one.param.code;
                         });

TEST(SimulatedCampaign, RefusesAnUnknownEffectWithItsPlace) {
  auto campaign = example_campaign();
  campaign.model.effects[0].effect = "magic";
  const auto result = run_simulated_campaign(example_rig(), campaign);
  ASSERT_FALSE(result.ok());
  EXPECT_THAT(result.error().what, ::testing::HasSubstr("magic"));
}

}  // namespace
}  // namespace shaker::daemon
