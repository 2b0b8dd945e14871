// The frames of oleosim must agree with its DBC file; the daemon's decoder reads them.
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <span>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/can/database.hpp"
#include "sim/can_face.hpp"

namespace shaker::sim {
namespace {

namespace can = protocol::can;

const can::Database& database() {
  static const can::Database made = [] {
    std::ifstream file(SHAKER_SOURCE_DIR "/sim/oleosim.dbc");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    auto parsed = can::parse_dbc(text, "oleosim.dbc");
    if (!parsed) throw std::runtime_error(parsed.error().what);
    return *parsed;
  }();
  return made;
}

double value(const can_frame& frame, std::string_view message, std::string_view signal) {
  const auto* described = database().find(message);
  if (!described || described->id != frame.can_id || described->size != frame.can_dlc) {
    ADD_FAILURE() << message << " is not what the DBC says";
    return 0.0;
  }
  const auto decoded = can::decode(*described, *described->find(signal),
                                   std::span<const std::uint8_t>(frame.data, frame.can_dlc));
  EXPECT_EQ(decoded.presence, can::Presence::present);
  return decoded.value;
}

TEST(CanFrames, CarryTheSamplesAsTheDbcSays) {
  for (const double stroke : {0.1589, -0.02, 0.0}) {
    for (const double table : {3.04812, -9.9, 0.0}) {
      RigSample sample;
      sample.displacement = stroke;
      sample.excitation = table;
      sample.counter = 0x12345;
      EXPECT_NEAR(value(stroke_frame(sample), "STROKE", "position"), stroke, 1e-8);
      EXPECT_EQ(value(stroke_frame(sample), "STROKE", "counter"), 0x2345);
      EXPECT_EQ(value(stroke_frame(sample), "STROKE", "error"), 0);
      EXPECT_NEAR(value(table_frame(sample), "TABLE", "acceleration"), table, 5.1e-6);
      EXPECT_EQ(value(table_frame(sample), "TABLE", "counter"), 0x2345);
    }
  }
}

TEST(CanFrames, CarryTheAuxiliaryQuantitiesUnderTheirNames) {
  const char* const messages[] = {"AUX_A", "AUX_B", "AUX_C", "AUX_D"};
  RigSample sample;
  for (std::size_t i = 0; i < kAuxiliaryMost; ++i)
    sample.auxiliary[i] = 0.5 + static_cast<double>(i);
  for (std::size_t i = 0; i < kAuxiliaryMost; ++i) {
    EXPECT_EQ(value(auxiliary_frame(sample, i / 2), messages[i / 2], auxiliary_table()[i].name),
              0.5 + static_cast<double>(i));
  }
}

TEST(CanFrames, SayWhenTheStrokeIsNotANumber) {
  RigSample sample;
  sample.displacement = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(value(stroke_frame(sample), "STROKE", "position")));
  EXPECT_EQ(value(stroke_frame(sample), "STROKE", "error"), 1);
}

// The bytes, written by hand: 2.5 Hz = 09C4, 3 m/s^2 = 0BB8, enabled, ramp 0.2 s, heartbeat
// 0102.
TEST(CanFrames, SetpointsDriveTheControllerAndStatusReportsIt) {
  VirtualRig rig(RigOptions{}, Nanoseconds(0));
  can_frame setpoint{};
  setpoint.can_id = 256;
  setpoint.can_dlc = 8;
  const std::array<std::uint8_t, 8> bytes = {0xC4, 0x09, 0xB8, 0x0B, 0x01, 0x02, 0x02, 0x01};
  std::copy(bytes.begin(), bytes.end(), setpoint.data);
  obey(setpoint, rig);
  EXPECT_EQ(rig.settings().frequency_hz, 2.5);
  EXPECT_EQ(rig.settings().amplitude, 3.0);
  EXPECT_EQ(rig.settings().heartbeat, 0x0102u);
  EXPECT_NEAR(rig.settings().ramp_s, 0.2, 1e-12);
  EXPECT_TRUE(rig.settings().enable);
  std::vector<RigSample> samples;
  rig.advance(std::chrono::milliseconds(300), samples);
  const can_frame status = status_frame(rig.status());
  EXPECT_EQ(value(status, "STATUS", "status"), 3);
  EXPECT_EQ(value(status, "STATUS", "fault"), 0);
  EXPECT_NEAR(value(status, "STATUS", "frequency"), 2.5, 1e-9);
  EXPECT_NEAR(value(status, "STATUS", "amplitude"), 3.0, 1e-9);
  setpoint.data[4] = 0;
  obey(setpoint, rig);
  EXPECT_FALSE(rig.status().running);
  setpoint.can_id = 255;
  setpoint.data[4] = 1;
  obey(setpoint, rig);
  EXPECT_FALSE(rig.status().running);
}

}  // namespace
}  // namespace shaker::sim
