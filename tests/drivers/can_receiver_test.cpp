#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/can/dbc_file.hpp"
#include "drivers/can/receiver.hpp"
#include "protocol/can/candump_log.hpp"

namespace shaker::drivers::can {
namespace {

using namespace std::chrono_literals;
using protocol::Channel;
using protocol::can::Frame;
using testing::HasSubstr;

constexpr auto kDbc = SHAKER_TEST_DATA "/can/rig.dbc";

Frame frame(const std::string& text) {
  const auto entry = protocol::can::parse_log_line("(0.0) can0 " + text);
  EXPECT_TRUE(entry) << text;
  return entry ? entry->frame : Frame{};
}

std::vector<config::CanSignal> signals() {
  return {{Channel::displacement, "transducer_tpdo1", "position", 1.0, 0.0},
          {Channel::excitation, "accelerometer", "table", 1.0, 0.0},
          {Channel::acceleration, "accelerometer", "mass", -1.0, 0.5}};
}

FrameDecoder decoder(const std::vector<config::CanSignal>& wanted = signals()) {
  auto database = load_dbc(kDbc);
  EXPECT_TRUE(database.ok());
  auto made = FrameDecoder::make(std::move(*database), wanted);
  EXPECT_TRUE(made.ok()) << made.error().what;
  return std::move(*made);
}

std::string refusal(const std::vector<config::CanSignal>& wanted) {
  auto made = FrameDecoder::make(*load_dbc(kDbc), wanted);
  return made.ok() ? "accepted" : made.error().what;
}

// A receiver, and the block of one read().
struct Bench {
  explicit Bench(std::optional<config::CanOpen> canopen = std::nullopt,
                 const std::vector<config::CanSignal>& wanted = signals())
      : receiver(decoder(wanted), "can0", canopen) {
    receiver.connected(0ns);
  }
  void take(const std::string& text, Nanoseconds t) { receiver.take(frame(text), t, block); }

  std::array<Sample, 16> samples{};
  Block block{samples};
  Receiver receiver;
};

// The database's unit is converted, unless the rig file gives a scale.
TEST(CanDecoder, ConvertsTheUnitThatTheDatabaseStates) {
  protocol::can::Database database;
  auto& message = database.messages.emplace_back();
  message.name = "m";
  message.id = 0x10;
  message.size = 4;
  auto& signal = message.signals.emplace_back();
  signal.name = "s";
  signal.length = 32;
  const auto value = [&](const char* unit, const config::CanSignal& asked) {
    signal.unit = unit;
    auto made = FrameDecoder::make(database, std::array{asked});
    if (!made.ok()) return -1.0;
    std::array<Sample, 1> out;
    const auto outcome = made->decode(frame("010#E8030000"), 0ns, out);  // 1000
    return outcome.samples == 1 ? out[0].value : -2.0;
  };
  config::CanSignal stroke{Channel::displacement, "m", "s"};
  EXPECT_DOUBLE_EQ(value("", stroke), 1000.0);
  EXPECT_DOUBLE_EQ(value("mm", stroke), 1.0);
  EXPECT_DOUBLE_EQ(value("ft", stroke), 304.8);
  EXPECT_EQ(value("g", stroke), -1.0);
  EXPECT_EQ(value("furlong", stroke), -1.0);
  stroke.scale = 2e-3;
  EXPECT_DOUBLE_EQ(value("mm", stroke), 2.0);
  config::CanSignal pressure{Channel::aux1, "m", "s"};
  EXPECT_DOUBLE_EQ(value("kPa", pressure), 1000.0) << "nothing says what is wanted";
  pressure.unit = "bar";
  EXPECT_DOUBLE_EQ(value("kPa", pressure), 10.0);
  EXPECT_EQ(value("mm", pressure), -1.0);

  // From the rig file to the value: its unit takes the place of that in the database.
  const auto rig = config::parse_rig(
      R"({"name": "r", "exciter": {"device": {"kind": "replay"}},
          "sensors": [{"kind": "can", "dbc": "a.dbc", "signals": [{"channel": "displacement",
            "message": "m", "signal": "s", "scale": -0.5, "offset": 10, "unit": "in"}]}]})",
      "r.json");
  ASSERT_TRUE(rig) << rig.error().what;
  EXPECT_DOUBLE_EQ(value("mm", std::get<config::CanSensor>(rig->sensors[0]).signals[0]),
                   -490.0 * 0.0254);
}

TEST(CanDecoder, SaysWhatTheDatabaseHasInsteadOfWhatWasAsked) {
  EXPECT_THAT(refusal({{Channel::displacement, "tpdo", "position", 1.0, 0.0}}),
              HasSubstr("no message 'tpdo'; it has: transducer_tpdo1, accelerometer"));
  EXPECT_THAT(refusal({{Channel::displacement, "transducer_tpdo1", "pos", 1.0, 0.0}}),
              HasSubstr("no signal 'pos'; it has: position, velocity, sensor_status"));
  EXPECT_THAT(refusal({}), HasSubstr("no signals"));
}

TEST(CanDecoder, SaysWhichDbcFileCannotBeRead) {
  EXPECT_THAT(load_dbc("/nowhere/x.dbc").error().what, HasSubstr("/nowhere/x.dbc: No such file"));
  EXPECT_THAT(load_dbc(SHAKER_TEST_DATA).error().what, HasSubstr("is a folder"));
}

TEST(CanReceiver, TurnsAFrameIntoItsSamplesInSi) {
  Bench bench;
  bench.take("120#03E8FF9C0000", 7ms);  // table 1.000, mass -0.100 (page 0)
  ASSERT_EQ(bench.block.count, 2u);
  EXPECT_EQ(bench.samples[0].channel, Channel::excitation);
  EXPECT_DOUBLE_EQ(bench.samples[0].value, 1.0);
  EXPECT_EQ(bench.samples[1].channel, Channel::acceleration);
  EXPECT_DOUBLE_EQ(bench.samples[1].value, 0.6);
  EXPECT_EQ(bench.samples[1].t, 7ms);
  bench.take("120#03E8FF9C0100", 8ms);  // page 1: the mass is not in this frame
  EXPECT_EQ(bench.block.count, 3u);
  EXPECT_EQ(bench.receiver.health().malformed, 0u);
  EXPECT_EQ(bench.receiver.health().samples, 3u);
}

TEST(CanReceiver, AcceptsATransducersSixAndSevenBytes) {
  Bench bench;
  bench.take("181#40E20100FFFF", 1ms);  // 123456 nm
  bench.take("181#40E20100FFFF00", 2ms);
  ASSERT_EQ(bench.block.count, 2u);
  EXPECT_DOUBLE_EQ(bench.samples[0].value, 123456e-9);
  EXPECT_DOUBLE_EQ(bench.samples[1].value, 123456e-9);
  EXPECT_EQ(bench.receiver.health().malformed, 0u);
}

TEST(CanReceiver, CountsFramesThatAreTooShort) {
  Bench bench;
  bench.take("181#40E201", 1ms);
  bench.take("181#", 2ms);
  bench.take("120#03E8", 3ms);  // the table's value is complete, the multiplexor is missing
  EXPECT_EQ(bench.receiver.health().malformed, 3u);
  ASSERT_EQ(bench.block.count, 1u);
  EXPECT_DOUBLE_EQ(bench.samples[0].value, 1.0);
}

TEST(CanReceiver, MarksValuesOutsideTheDatabasesRangeAndNotANumberAsBad) {
  Bench bench(std::nullopt, {{Channel::displacement, "transducer_tpdo1", "position", 1.0, 0.0},
                             {Channel::force, "load_cell", "force", 1.0, 0.0}});
  bench.take("181#0065CD1DFFFF", 1ms);  // exactly 0.5 m
  bench.take("181#0265CD1DFFFF", 2ms);  // 2 nm more
  bench.take("18FEF1FE#0000C07F00000000", 3ms);
  ASSERT_EQ(bench.block.count, 3u);
  EXPECT_EQ(bench.samples[0].quality, Quality::good);
  EXPECT_EQ(bench.samples[1].quality, Quality::bad);
  EXPECT_EQ(bench.samples[2].quality, Quality::bad);
  EXPECT_TRUE(std::isnan(bench.samples[2].value));
}

TEST(CanReceiver, IgnoresOtherIdentifiersRemoteFramesAndTheSameNumberInTheOtherFormat) {
  Bench bench;
  bench.take("00000181#40E20100FFFF00", 1ms);
  bench.take("181#R7", 2ms);
  bench.take("182#40E20100FFFF00", 3ms);
  EXPECT_EQ(bench.block.count, 0u);
}

TEST(CanReceiver, SaysBusOffAndRecoversTwiceInARow) {
  Bench bench;
  Nanoseconds t = 10s;
  for (int round = 1; round <= 2; ++round, t += 10s) {
    bench.take("20000040#0000000000000000", t);
    EXPECT_FALSE(bench.receiver.health().link_up);
    EXPECT_THAT(bench.receiver.health().trouble, HasSubstr("bus-off"));
    bench.take("20000100#0000000000000000", t + 100ms);
    EXPECT_TRUE(bench.receiver.health().link_up);
    bench.take("181#40E20100FFFF", t + 200ms);
    EXPECT_THAT(bench.receiver.health().trouble, HasSubstr("restarted")) << "still worth reading";
    bench.block.count = 0;
    bench.take("181#40E20100FFFF", t + 100ms + 2s);
    EXPECT_THAT(bench.receiver.health().trouble, HasSubstr("restarted")) << "for two seconds";
    bench.block.count = 0;
    bench.take("181#40E20100FFFF", t + 100ms + 2s + 1ns);
    EXPECT_EQ(bench.receiver.health().trouble, "");
    EXPECT_EQ(bench.receiver.health().errors, 2u * static_cast<unsigned>(round));
  }
}

TEST(CanReceiver, CountsWhatTheControllerItselfDropped) {
  Bench bench;
  bench.take("20000004#0001000000000000", 1s);
  EXPECT_EQ(bench.receiver.health().lost, 1u);
}

TEST(CanReceiver, SaysOnceThatTheSensorIsSilentAndRecoversTwice) {
  Bench bench;
  Nanoseconds t{};
  for (unsigned round = 1; round <= 2; ++round) {
    bench.receiver.look_at_silence(t + 100ms);
    EXPECT_EQ(bench.receiver.health().trouble, "");
    for (int look = 0; look < 3; ++look)
      bench.receiver.look_at_silence(t + 101ms);
    EXPECT_THAT(
        bench.receiver.health().trouble,
        HasSubstr("can0: the sensor has been silent for 0.1 s, its messages are due every 1 ms"));
    EXPECT_EQ(bench.receiver.health().errors, round);
    t += 5s;
    bench.take("181#40E20100FFFF", t);
    EXPECT_EQ(bench.receiver.health().trouble, "");
    bench.block.count = 0;
  }
}

// The database of the virtual rig has a 16-bit counter and an error flag in the stroke message.
TEST(CanReceiver, CountsGapsInACounterAndBelievesTheSensorsErrorFlag) {
  auto database = load_dbc(SHAKER_SOURCE_DIR "/config/examples/oleosim.dbc");
  ASSERT_TRUE(database.ok()) << database.error().what;
  auto made = FrameDecoder::make(
      std::move(*database),
      std::vector<config::CanSignal>{{Channel::displacement, "STROKE", "position", 1.0, 0.0}});
  ASSERT_TRUE(made.ok()) << made.error().what;
  Receiver receiver(std::move(*made), "can0", std::nullopt);
  receiver.connected(0ns);
  std::array<Sample, 16> samples;
  Block block{samples, 0};
  const auto take = [&](const std::string& text) { receiver.take(frame(text), 1ms, block); };
  take("181#00000000FDFF00");  // FFFD
  take("181#00000000FEFF00");
  EXPECT_EQ(receiver.health().lost, 0u);
  take("181#00000000010000");  // wrapped: FFFF and 0000 are missing
  EXPECT_EQ(receiver.health().lost, 2u);
  take("181#00000000010000");  // repeated
  take("181#00000000F0FF01");  // backwards: the sensor restarted; its error flag is set
  EXPECT_EQ(receiver.health().lost, 2u);
  ASSERT_EQ(block.count, 5u);
  EXPECT_EQ(samples[3].quality, Quality::good);
  EXPECT_EQ(samples[4].quality, Quality::bad);
  receiver.count_dropped(3);
  take("181#00000000F5FF00");  // F1 to F4 are missing: the three dropped, and one on the bus
  EXPECT_EQ(receiver.health().lost, 2u + 4u);
  take("181#00000000F8FF00");  // F6 and F7 are missing: dropped frames explain no second gap
  EXPECT_EQ(receiver.health().lost, 6u + 2u);
  receiver.connected(2ms);
  take("181#00000000500000");
  EXPECT_EQ(receiver.health().lost, 8u) << "what passed while there was no link is not counted";
}

// ---- CANopen ------------------------------------------------------------------------------------

config::CanOpen node_one(double sync_period_s = 0.0) {
  return {1, true, sync_period_s};
}

std::vector<Frame> sent(Receiver& receiver, Nanoseconds now) {
  std::vector<Frame> frames;
  for (Frame out; receiver.canopen()->next_to_send(now, out);)
    frames.push_back(out);
  return frames;
}

TEST(CanOpen, StartsTheNodeOnceWhenConnected) {
  Bench bench(node_one());
  const auto frames = sent(bench.receiver, 0ns);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].id, 0u);
  EXPECT_THAT(frames[0].bytes(), testing::ElementsAre(0x01, 0x01));
  EXPECT_TRUE(sent(bench.receiver, 1s).empty());
}

TEST(CanOpen, LeavesTheNodeToAnotherMasterWhenAsked) {
  Bench bench(config::CanOpen{1, false, 0.0});
  bench.take("701#00", 1ms);
  EXPECT_TRUE(sent(bench.receiver, 1s).empty());
}

TEST(CanOpen, SendsSyncOnAbsoluteDeadlinesAndNoBurstAfterAPause) {
  Bench bench(node_one(0.01));
  EXPECT_EQ(sent(bench.receiver, 0ns).size(), 2u) << "start and the first SYNC";
  EXPECT_TRUE(sent(bench.receiver, 9ms).empty());
  EXPECT_EQ(sent(bench.receiver, 13ms).size(), 1u);
  EXPECT_EQ(bench.receiver.canopen()->next_deadline(), 20ms) << "no drift from being 3 ms late";
  const auto after_pause = sent(bench.receiver, 500ms);
  ASSERT_EQ(after_pause.size(), 1u);
  EXPECT_EQ(after_pause[0].id, 0x80u);
  EXPECT_EQ(after_pause[0].length, 0);
}

TEST(CanOpen, DiscardsTheBlockAndStartsAgainWhenTheSensorBootsInMidRun) {
  Bench bench(node_one());
  sent(bench.receiver, 0ns);
  bench.take("701#00", 1ms);  // switched on after us: no error
  EXPECT_EQ(bench.receiver.health().trouble, "");
  EXPECT_EQ(sent(bench.receiver, 1ms).size(), 1u);
  for (int round = 0; round < 2; ++round) {
    bench.take("181#40E20100FFFF", 10ms);
    bench.take("181#40E20100FFFF", 11ms);
    bench.take("701#00", 12ms);
    EXPECT_EQ(bench.block.count, 0u);
    EXPECT_EQ(bench.receiver.health().lost, 2u * static_cast<unsigned>(round + 1));
    EXPECT_THAT(bench.receiver.health().trouble, HasSubstr("lost power"));
    EXPECT_EQ(sent(bench.receiver, 12ms).size(), 1u);
  }
}

TEST(CanOpen, StartsANodeThatItsHeartbeatShowsAtRest) {
  Bench bench(node_one());
  sent(bench.receiver, 0ns);
  bench.take("701#05", 1ms);
  EXPECT_TRUE(sent(bench.receiver, 1ms).empty());
  bench.take("701#7F", 2ms);
  EXPECT_THAT(bench.receiver.health().trouble, HasSubstr("pre-operational"));
  EXPECT_EQ(sent(bench.receiver, 2ms).size(), 1u);
  bench.take("701#04", 3ms);
  EXPECT_THAT(bench.receiver.health().trouble, HasSubstr("is stopped (4)"));
}

TEST(CanOpen, ReportsAnEmergencyAndSuspectsSamplesUntilItIsOver) {
  Bench bench(node_one());
  bench.take("081#3042110000000000", 1ms);
  EXPECT_THAT(bench.receiver.health().trouble,
              HasSubstr("emergency 0x4230 (temperature), error register 0x11"));
  bench.take("181#40E20100FFFF", 2ms);
  bench.take("081#0000000000000000", 3ms);
  bench.take("181#40E20100FFFF", 4ms);
  ASSERT_EQ(bench.block.count, 2u);
  EXPECT_EQ(bench.samples[0].quality, Quality::suspect);
  EXPECT_EQ(bench.samples[1].quality, Quality::good);
  EXPECT_EQ(bench.receiver.health().errors, 1u);
}

TEST(CanOpen, IgnoresCutFramesAndOtherNodes) {
  Bench bench(node_one());
  sent(bench.receiver, 0ns);
  bench.take("701#", 1ms);
  bench.take("081#30", 1ms);
  bench.take("702#00", 1ms);
  EXPECT_EQ(bench.receiver.health().errors, 0u);
  EXPECT_TRUE(sent(bench.receiver, 1ms).empty());
}

}  // namespace
}  // namespace shaker::drivers::can
