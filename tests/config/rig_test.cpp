#include "config/rig.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::config {
namespace {

const std::filesystem::path kRigExamples =
    std::filesystem::path(SHAKER_SOURCE_DIR) / "config" / "examples";

TEST(Rig, OfRealHardwareIsReadAsItIsWritten) {
  const auto rig = load_rig(kRigExamples / "rig-modbus-can.json");
  ASSERT_TRUE(rig) << rig.error().what;
  EXPECT_EQ(rig->name, "drop-tower-2");
  EXPECT_EQ(rig->model, "model-oleo.json");
  EXPECT_EQ(rig->directory, kRigExamples);
  const auto& device = std::get<ModbusExciter>(rig->exciter.device);
  EXPECT_EQ(std::get<ModbusTcp>(device.link.transport).host, "192.168.1.20");
  const auto& frequency = device.registers.at("frequency");
  EXPECT_EQ(frequency.address, 100);
  EXPECT_EQ(frequency.type, protocol::modbus::RegisterType::f32);
  EXPECT_EQ(frequency.order, protocol::modbus::WordOrder::cdab);
  EXPECT_FALSE(frequency.cyclic);
  EXPECT_TRUE(device.registers.at("heartbeat").cyclic);
  EXPECT_DOUBLE_EQ(device.registers.at("ramp").scale, 0.1);
  EXPECT_EQ(device.registers.at("status").table, protocol::modbus::RegisterTable::input);
  const auto& sensor = std::get<CanSensor>(rig->sensors.at(0));
  EXPECT_EQ(sensor.signals.at(1).channel, protocol::Channel::excitation);
  EXPECT_EQ(sensor.signals.at(0).message, "STROKE");
  EXPECT_DOUBLE_EQ(sensor.signals.at(0).scale.value(), 0.001);
  EXPECT_EQ(sensor.canopen->node_id, 5);
  EXPECT_EQ(rig->limits.stale_action, Action::ramp_down);
  EXPECT_DOUBLE_EQ(rig->limits.stroke_min_m, 0.01);
}

TEST(Rig, OnSerialLinesHasItsLineSettings) {
  const auto rig = load_rig(kRigExamples / "rig-rtu.json");
  ASSERT_TRUE(rig) << rig.error().what;
  const auto& rtu =
      std::get<ModbusRtu>(std::get<ModbusExciter>(rig->exciter.device).link.transport);
  EXPECT_EQ(rtu.device, "/dev/ttyUSB0");
  EXPECT_EQ(rtu.baud, 115200);
  EXPECT_EQ(rtu.parity, 'E');
  EXPECT_EQ(std::get<ModbusSensor>(rig->sensors.at(0)).registers.size(), 1u);
}

// value * scale + offset is in the unit that the file states: a transducer in mm that counts the
// other way, from 1 mm on, and a pressure whose DBC file has no unit.
TEST(Rig, ConvertsTheUnitThatTheScaleOfASignalLeadsTo) {
  const auto rig = parse_rig(
      R"({"name": "r", "exciter": {"device": {"kind": "replay"}},
          "auxiliary": {"aux1": {"name": "gas", "unit": "kPa"}},
          "sensors": [{"kind": "can", "dbc": "a.dbc", "signals": [
            {"channel": "displacement", "message": "M", "signal": "s", "scale": -1, "offset": 1,
             "unit": "mm"},
            {"channel": "excitation", "message": "M", "signal": "x", "unit": "g"},
            {"channel": "acceleration", "message": "M", "signal": "a"},
            {"channel": "aux1", "message": "M", "signal": "p", "scale": 2, "unit": "bar"}]}]})",
      "r.json");
  ASSERT_TRUE(rig) << rig.error().what;
  const auto& signals = std::get<CanSensor>(rig->sensors.at(0)).signals;
  EXPECT_DOUBLE_EQ(signals.at(0).scale.value(), -1e-3);
  EXPECT_DOUBLE_EQ(signals.at(0).offset.value(), 1e-3);
  EXPECT_DOUBLE_EQ(signals.at(1).scale.value(), 9.80665);
  EXPECT_FALSE(signals.at(2).scale) << "the unit in the DBC file counts";
  EXPECT_DOUBLE_EQ(signals.at(3).scale.value(), 200.0);
  EXPECT_EQ(signals.at(3).unit, "kPa");
}

TEST(Rig, ConvertsWhatAnAuxiliaryRegisterIsMeasuredIn) {
  const auto rig = [](const std::string& unit, const std::string& label) {
    return parse_rig(
        R"({"name": "r", "exciter": {"device": {"kind": "simulated"}}, "auxiliary": {
              "aux1": {"name": "gas", "unit": ")" +
            label + R"("}}, "sensors": [{"kind": "simulated"}, {"kind": "modbus",
              "link": {"transport": {"kind": "tcp", "host": "h"}}, "registers": {
              "aux1": {"address": 0, "type": "u16", "scale": 2, "offset": 1, "unit": ")" +
            unit + R"("}}}]})",
        "r.json");
  };
  const auto read = [&](const std::string& unit, const std::string& label) {
    const auto found = rig(unit, label);
    EXPECT_TRUE(found) << found.error().what;
    return std::get<ModbusSensor>(found->sensors.at(1)).registers.at(protocol::Channel::aux1);
  };
  EXPECT_DOUBLE_EQ(read("psi", "psi").scale, 2.0);
  EXPECT_NEAR(read("psi", "kPa").scale, 2.0 * 6.894757, 1e-5);
  EXPECT_NEAR(read("psi", "kPa").offset, 6.894757, 1e-5);
  EXPECT_NEAR(read("degF", "degC").scale, 10.0 / 9.0, 1e-12);
  EXPECT_NEAR(read("degF", "degC").offset, -31.0 * 5.0 / 9.0, 1e-9);
  EXPECT_DOUBLE_EQ(read("", "volts of the bridge").scale, 2.0);
  EXPECT_DOUBLE_EQ(read("mV/V", "mV/V").scale, 2.0) << "what is not converted needs not be known";
  const auto refused = rig("mV", "kPa");
  ASSERT_FALSE(refused);
  EXPECT_THAT(
      refused.error().what,
      ::testing::HasSubstr("aux1 is measured in \"mV\", which cannot be converted into \"kPa\"; "
                           "known are Pa, kPa, MPa, mbar, bar, atm, psi"));
}

TEST(Rig, TakesDefaultsForWhatIsLeftOut) {
  const auto rig = parse_rig(
      R"({"name": "r", "exciter": {"device": {"kind": "simulated"}},
          "sensors": [{"kind": "simulated"}]})",
      "r.json");
  ASSERT_TRUE(rig) << rig.error().what;
  EXPECT_TRUE(std::holds_alternative<SimulatedExciter>(rig->exciter.device));
  EXPECT_DOUBLE_EQ(rig->exciter.ramp_s, ExciterConfig{}.ramp_s);
  EXPECT_DOUBLE_EQ(rig->limits.stroke_max_m, Limits{}.stroke_max_m);
  EXPECT_DOUBLE_EQ(std::get<SimulatedSensor>(rig->sensors.at(0)).rate_hz, 1000.0);
}

constexpr auto kAuxiliaryRig = R"({"name": "r", "exciter": {"device": {"kind": "simulated"}},
  "sensors": [{"kind": "simulated", "auxiliary": {"aux1": "gas_pressure"}}]%s})";

std::string with_auxiliary(const std::string& member) {
  std::string text = kAuxiliaryRig;
  return text.replace(text.find("%s"), 2, member);
}

TEST(Rig, GivesAuxiliaryChannelsNamesAndUnits) {
  const auto rig = parse_rig(
      with_auxiliary(R"(, "auxiliary": {"aux1": {"name": "gas_pressure", "unit": "Pa"}})"), "r");
  ASSERT_TRUE(rig) << rig.error().what;
  EXPECT_EQ(rig->auxiliary.at(protocol::Channel::aux1).name, "gas_pressure");
  EXPECT_EQ(protocol::label(protocol::Channel::aux1, rig->auxiliary).unit, "Pa");
  EXPECT_EQ(protocol::label(protocol::Channel::force, rig->auxiliary).unit, "N");
}

TEST(Rig, RefusesAuxiliaryChannelsThatNobodyCouldRead) {
  const auto trouble = [](const std::string& member) {
    const auto rig = parse_rig(with_auxiliary(member), "r");
    return rig ? std::string("accepted") : rig.error().what;
  };
  EXPECT_THAT(trouble(""), testing::HasSubstr("a sensor gives aux1, which has no name and unit"));
  EXPECT_THAT(trouble(R"(, "auxiliary": {"aux1": {"name": "p", "unit": "Pa"},
                                         "aux2": {"name": "t", "unit": "K"}})"),
              testing::HasSubstr("aux2 (\"t\") is given by no sensor"));
  EXPECT_THAT(trouble(R"(, "auxiliary": {"aux1": {"name": "gas, hot", "unit": "Pa"}})"),
              testing::HasSubstr("/auxiliary/aux1/name: \"gas, hot\" is no name of a channel"));
  EXPECT_THAT(trouble(R"(, "auxiliary": {"aux1": {"name": "force", "unit": "N"}})"),
              testing::HasSubstr("\"force\" is another channel's name"));
  EXPECT_THAT(trouble(R"(, "auxiliary": {"aux9": {"name": "p", "unit": "Pa"}})"),
              testing::HasSubstr("/auxiliary/aux9: unknown key"));
}

std::string with_limits(const std::string& more) {
  return R"({"name": "r", "exciter": {"device": {"kind": "simulated"}},
             "sensors": [{"kind": "simulated"}], )" +
         more + "}";
}

constexpr auto kNothingActs = R"("limits": {
  "stroke_action": "none", "stroke_rate_action": "indicate", "excitation_action": "hold",
  "stale_action": "none", "command_error_action": "none", "response_change_action": "none",
  "under_peak_action": "stop"})";

TEST(Rig, WithoutAnyProtectionMustSaySo) {
  const auto refused = parse_rig(with_limits(kNothingActs), "r");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, testing::HasSubstr("no detector ends the motion"));
  const auto meant =
      parse_rig(with_limits(kNothingActs + std::string(R"(, "unprotected": true)")), "r");
  ASSERT_TRUE(meant) << meant.error().what;
  EXPECT_TRUE(meant->unprotected);
}

TEST(Rig, IsProtectedByEachDetectorThatEndsTheMotion) {
  const auto rig = parse_rig(with_limits(R"("client_lease_s": 1)"), "r");
  ASSERT_TRUE(rig) << rig.error().what;
  EXPECT_FALSE(rig->unprotected);
  for (const Guard& guard : guards(rig->limits)) {
    std::string text = kNothingActs;
    const std::string key = "\"" + std::string(guard.key) + "\": \"";
    const auto from = text.find(key) + key.size();
    text.replace(from, text.find('"', from) - from, "ramp_down");
    if (std::string(guard.key) == "under_peak_action") {
      text.replace(text.rfind('}'), 1, R"(, "under_peak_fraction": 0.5})");
    }
    EXPECT_TRUE(parse_rig(with_limits(text), "r")) << text;
  }
}

TEST(Rig, TakesTimesAtTheirBounds) {
  const auto rig = parse_rig(
      R"({"name": "r", "exciter": {"device": {"kind": "simulated"}, "deadman_max_s": 0.3,
          "heartbeat_period_s": 0.1}, "sensors": [{"kind": "simulated"}]})",
      "r");
  ASSERT_TRUE(rig) << rig.error().what;
  EXPECT_DOUBLE_EQ(rig->exciter.deadman_max_s, 0.3);
  EXPECT_DOUBLE_EQ(ExciterConfig{}.deadman_max_s, 1.0);
}

TEST(Rig, TellsSeveralMistakesAtOnceWithTheirLines) {
  const auto rig = parse_rig(
      "{\"name\": \"r\",\n \"exciter\": {\"device\": {\"kind\": \"simulated\"},\n"
      " \"ramp_s\": -1},\n \"sensors\": [{\"kind\": \"simulated\",\n \"rate\": 5}]}",
      "r.json");
  ASSERT_FALSE(rig);
  EXPECT_EQ(rig.error().what,
            "r.json:3: /exciter/ramp_s: -1 is out of range; at least 0 and at most 600 is allowed\n"
            "r.json:5: /sensors/0/rate: unknown key; did you mean \"rate_hz\"?");
}

TEST(Rig, CountsMistakesBeyondTwenty) {
  std::string text =
      "{\"name\": \"r\", \"exciter\": {\"device\": {\"kind\": \"simulated\"}}, "
      "\"sensors\": [{\"kind\": \"simulated\"}]";
  for (int i = 0; i < 25; ++i)
    text += ", \"nonsense" + std::to_string(i) + "\": 1";
  const auto rig = parse_rig(text + "}", "r.json");
  ASSERT_FALSE(rig);
  EXPECT_THAT(rig.error().what, testing::EndsWith("r.json: and 5 more"));
}

}  // namespace
}  // namespace shaker::config
