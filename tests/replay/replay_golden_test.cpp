// A replayed log gives exactly the stream that tests/replay/golden.py derived from it.
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/replay/replay_sensor.hpp"

namespace shaker::drivers::replay {
namespace {

using protocol::Channel;

config::ReplaySensor settings(const std::string& log) {
  config::ReplaySensor config;
  config.file = "replay/" + log + ".log";
  config.dbc = "data/can/rig.dbc";
  config.signals = {{Channel::displacement, "transducer_tpdo1", "position", 1.0, 0.0},
                    {Channel::displacement, "wide", "last", 1.0, 0.0},
                    {Channel::excitation, "accelerometer", "table", 1.0, 0.0},
                    {Channel::acceleration, "accelerometer", "mass", -1.0, 0.5},
                    {Channel::force, "load_cell", "force", 1.0, 0.0}};
  return config;
}

std::string_view name(Quality quality) {
  return quality == Quality::good ? "good" : quality == Quality::suspect ? "suspect" : "bad";
}

class Golden : public testing::TestWithParam<const char*> {};

TEST_P(Golden, StreamIsWhatTheIndependentScriptSays) {
  SimulatedClock clock;
  clock.advance(std::chrono::hours(1));
  auto made = make_replay_sensor(settings(GetParam()), SHAKER_SOURCE_DIR "/tests", clock);
  ASSERT_TRUE(made.ok()) << made.error().what;
  auto& sensor = **made;
  std::ifstream golden(std::string(SHAKER_SOURCE_DIR "/tests/replay/") + GetParam() + ".golden");
  ASSERT_TRUE(sensor.connect().ok());
  std::array<Sample, 7> out;
  std::size_t row = 0;
  std::string line;
  while (!sensor.finished()) {
    const auto count = sensor.read(out, Nanoseconds{0});
    ASSERT_TRUE(count.ok());
    ASSERT_GT(*count, 0u);
    for (const Sample& sample : std::span(out).first(*count)) {
      ++row;
      ASSERT_TRUE(std::getline(golden, line));
      std::istringstream fields(line);
      std::int64_t t = 0;
      std::string channel, value, quality;
      fields >> t >> channel >> value >> quality;
      SCOPED_TRACE(testing::Message() << "row " << row << ": " << line);
      EXPECT_EQ((sample.t - std::chrono::hours(1)).count(), t);
      EXPECT_EQ(protocol::name(sample.channel), channel);
      EXPECT_EQ(name(sample.quality), quality);
      if (value == "nan") {
        EXPECT_TRUE(std::isnan(sample.value));
      } else {
        EXPECT_DOUBLE_EQ(sample.value, std::stod(value));
      }
    }
  }
  const auto health = sensor.health();
  std::ostringstream counters;
  counters << "samples " << health.samples << " malformed " << health.malformed << " errors "
           << health.errors << " lost " << health.lost;
  ASSERT_TRUE(std::getline(golden, line));
  EXPECT_EQ(counters.str(), line);
  EXPECT_FALSE(std::getline(golden, line)) << "the golden stream goes on: " << line;
}

INSTANTIATE_TEST_SUITE_P(Logs, Golden, testing::Values("faults", "wide_fd", "transducer"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace shaker::drivers::replay
