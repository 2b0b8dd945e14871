// A damper that heats up or leaks while it is measured, seen through the whole chain: virtual rig,
// drivers, engine, online estimator, alarm.
#include <map>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "daemon/simulated_campaign.hpp"

namespace shaker::daemon {
namespace {

std::vector<protocol::AlarmDocument> changes(const std::map<std::string, double>& hidden) {
  auto rig =
      config::load_rig(fmt::format("{}/config/examples/rig-simulated.json", SHAKER_SOURCE_DIR))
          .value();
  for (const auto& [name, value] : hidden)
    std::get<config::SimulatedSensor>(rig.sensors[0]).parameters[name] = value;
  auto campaign = config::load_campaign(
                      fmt::format("{}/config/examples/campaign-three-runs.json", SHAKER_SOURCE_DIR))
                      .value();
  campaign.runs.resize(1);
  campaign.runs[0].cycles = 100;
  campaign.change_detection = config::ChangeDetectionSpec{.false_alarms_per_run = 0.01};
  const auto result = run_simulated_campaign(rig, campaign);
  EXPECT_TRUE(result.ok()) << result.error().what;
  std::vector<protocol::AlarmDocument> found;
  if (!result) return found;
  EXPECT_EQ(result->final_state, State::idle);
  for (const auto& document : result->documents) {
    const auto* alarm = std::get_if<protocol::AlarmDocument>(&document);
    if (alarm != nullptr && alarm->code == "parameter_change") found.push_back(*alarm);
  }
  return found;
}

TEST(ParameterChange, IsNotSeenInADamperThatStaysAsItIs) {
  for (const auto& alarm : changes({}))
    ADD_FAILURE() << alarm.text;
}

TEST(ParameterChange, NamesTheDampingOfADamperThatHeatsUp) {
  const auto alarms = changes({{"oil_warming", 0.02}});
  ASSERT_FALSE(alarms.empty());
  EXPECT_EQ(alarms[0].parameter, "theta1") << alarms[0].text;
  EXPECT_LT(*alarms[0].value, 0.0) << alarms[0].text;
  EXPECT_EQ(alarms[0].severity, "warning");
  EXPECT_TRUE(alarms[0].run && alarms[0].cycle && alarms[0].limit);
}

TEST(ParameterChange, NamesThePressureOfADamperThatLeaks) {
  const auto alarms = changes({{"gas_leak", 1e-4}, {"leak_opens", 40.0}});
  ASSERT_FALSE(alarms.empty());
  EXPECT_EQ(alarms[0].parameter, "theta2") << alarms[0].text;
  EXPECT_LT(*alarms[0].value, 0.0) << alarms[0].text;
}

}  // namespace
}  // namespace shaker::daemon
