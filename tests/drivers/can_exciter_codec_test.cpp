#include <array>
#include <fstream>
#include <iterator>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/can/can_exciter.hpp"
#include "drivers/can/can_sensor.hpp"
#include "drivers/can/dbc_file.hpp"
#include "drivers/can/exciter_codec.hpp"

namespace shaker::drivers::can {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

config::CanExciter settings() {
  config::CanExciter config;
  config.interface = "shakernone0";
  config.dbc = "rig.dbc";
  config.setpoint_message = "exciter_setpoint";
  config.status_message = "exciter_status";
  return config;
}

ExciterCodec codec() {
  auto made = ExciterCodec::make(*load_dbc(SHAKER_TEST_DATA "/can/rig.dbc"), settings());
  EXPECT_TRUE(made.ok()) << made.error().what;
  return std::move(*made);
}

TEST(CanExciterCodec, WritesTheSetpointFrame) {
  const auto frame = codec().setpoint({2.5, 9.81, true, 2.0}, 0x1FF);
  ASSERT_TRUE(frame.ok()) << frame.error().what;
  EXPECT_EQ(frame->id, 0x200u);
  // 2500 = 09C4, 9810 = 2652, 200 = 00C8, enable, counter 511 in 8 bits
  EXPECT_THAT(frame->bytes(), ElementsAre(0xC4, 0x09, 0x52, 0x26, 0xC8, 0x00, 0x01, 0xFF));
}

TEST(CanExciterCodec, RefusesASetpointThatTheDeviceCannotHold) {
  const auto refused = codec().setpoint({2.5, 70.0, true, 2.0}, 0);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().what, HasSubstr("amplitude 70 is outside 0 to 65 m/s^2"));
  EXPECT_FALSE(codec().setpoint({-1.0, 1.0, true, 2.0}, 0).ok());
}

TEST(CanExciterCodec, ReadsTheStatusFrame) {
  protocol::can::Frame frame;
  frame.id = 0x201;
  frame.length = 8;
  frame.data = {0x03, 0x00, 0x07, 0x01, 0xC4, 0x09, 0x52, 0x26};
  EXPECT_TRUE(codec().is_status(frame));
  const auto status = codec().status(frame, 5s);
  ASSERT_TRUE(status.ok());
  EXPECT_TRUE(status->running);
  EXPECT_FALSE(status->ready) << "a fault";
  EXPECT_EQ(status->fault, 0x107u);
  EXPECT_DOUBLE_EQ(*status->frequency_hz, 2.5);
  EXPECT_DOUBLE_EQ(*status->amplitude, 9.81);
  EXPECT_FALSE(status->heartbeat_timeout_s);
}

protocol::can::Frame status_frame(std::uint8_t flags, std::uint8_t fault = 0) {
  protocol::can::Frame frame;
  frame.id = 0x201;
  frame.length = 8;
  frame.data = {flags, 0x00, fault, 0x00, 0xC4, 0x09, 0x52, 0x26};
  return frame;
}

TEST(CanExciterCodec, IsReadyWithAllBitsOfTheMaskAndNoFault) {
  auto config = settings();
  config.status_running = 0x10;
  config.status_ready = 0x06;
  const auto made = ExciterCodec::make(*load_dbc(SHAKER_TEST_DATA "/can/rig.dbc"), config);
  ASSERT_TRUE(made.ok());
  const auto ready = [&](std::uint8_t flags, std::uint8_t fault) {
    return made->status(status_frame(flags, fault), 5s)->ready;
  };
  EXPECT_TRUE(ready(0x06, 0));
  EXPECT_TRUE(ready(0xFF, 0));
  EXPECT_FALSE(ready(0x02, 0)) << "one of two bits";
  EXPECT_FALSE(ready(0x04, 0));
  EXPECT_FALSE(ready(0xF9, 0));
  EXPECT_FALSE(ready(0x06, 1)) << "a fault";
  EXPECT_TRUE(made->status(status_frame(0x10), 5s)->running);
  EXPECT_FALSE(made->status(status_frame(0xEF), 5s)->running);
}

TEST(CanExciterCodec, RefusesAStatusOfAnotherLength) {
  for (const std::uint8_t length : {0, 3, 4, 7}) {
    auto frame = status_frame(3);
    frame.length = length;
    const auto refused = codec().status(frame, 5s);
    ASSERT_FALSE(refused.ok()) << int{length};
    EXPECT_EQ(refused.error().kind, ErrorKind::invalid) << "no reason to give up the link";
    EXPECT_THAT(refused.error().what, HasSubstr(std::to_string(length) + " bytes, expected 8"));
  }
}

TEST(CanExciterCodec, KnowsASetpointThatCommandsMotion) {
  protocol::can::Frame frame;
  frame.id = 0x200;
  frame.length = 8;
  frame.data = {0xC4, 0x09, 0x52, 0x26, 0xC8, 0x00, 0x01, 0xFF};
  ASSERT_TRUE(codec().is_setpoint(frame));
  EXPECT_TRUE(codec().commands_motion(frame));
  frame.data[6] = 0;
  EXPECT_FALSE(codec().commands_motion(frame)) << "not enabled";
  frame.data = {0xC4, 0x09, 0x00, 0x00, 0xC8, 0x00, 0x01, 0xFF};
  EXPECT_FALSE(codec().commands_motion(frame)) << "amplitude zero";
  frame.length = 7;
  EXPECT_TRUE(codec().commands_motion(frame)) << "nobody knows what a drive makes of it";
  frame.extended = true;
  EXPECT_FALSE(codec().is_setpoint(frame));
}

TEST(CanExciterCodec, TakesNothingElseForAStatus) {
  const auto spoofed = [](auto change) {
    auto frame = status_frame(3);
    change(frame);
    return codec().is_status(frame);
  };
  using protocol::can::Frame;
  EXPECT_TRUE(spoofed([](Frame&) {}));
  EXPECT_FALSE(spoofed([](Frame& f) { f.error = true; }));
  EXPECT_FALSE(spoofed([](Frame& f) { f.remote = true; }));
  EXPECT_FALSE(spoofed([](Frame& f) { f.extended = true; }));
  EXPECT_FALSE(spoofed([](Frame& f) { f.fd = true; }));
  EXPECT_FALSE(spoofed([](Frame& f) { f.id = 0x200; }));
}

TEST(CanExciterCodec, BelievesNoValueThatItsSignalCannotHave) {
  auto frame = status_frame(3);
  frame.data[6] = 0xFF;
  frame.data[7] = 0xFF;  // 65.535 m/s^2; the database says 0 to 65
  const auto status = codec().status(frame, 5s);
  ASSERT_TRUE(status.ok());
  EXPECT_FALSE(status->amplitude);
  EXPECT_DOUBLE_EQ(*status->frequency_hz, 2.5);
}

protocol::can::Database changed(const std::string& from, const std::string& to) {
  std::ifstream file(SHAKER_TEST_DATA "/can/rig.dbc");
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  auto database = protocol::can::parse_dbc(text, "x.dbc");
  EXPECT_TRUE(database.ok());
  return std::move(*database);
}

// Changes one word of the database and returns the error.
std::string refusal(const std::string& from, const std::string& to,
                    const config::CanExciter& config = settings()) {
  const auto made = ExciterCodec::make(changed(from, to), config);
  return made.ok() ? "accepted" : made.error().what;
}

// Changes one word of the database and returns the frame of a setpoint of 9.80665 m/s^2 at 2
// Hz.
protocol::can::Frame sent(const std::string& from, const std::string& to) {
  const auto made = ExciterCodec::make(changed(from, to), settings());
  EXPECT_TRUE(made.ok()) << made.error().what;
  return *made->setpoint({2.0, 9.80665, true, 1.0}, 0);
}
int word(const protocol::can::Frame& frame, std::size_t at) {
  return frame.data.at(at) + 256 * frame.data.at(at + 1);
}

TEST(CanExciterCodec, SendsTheUnitThatTheDatabaseStates) {
  EXPECT_EQ(word(sent("[0|65] \"m/s^2\" EXCITER", "[0|65] \"m/s^2\" EXCITER"), 2), 9807);
  EXPECT_EQ(word(sent("[0|65] \"m/s^2\" EXCITER", "[0|65] \"g\" EXCITER"), 2), 1000);
  EXPECT_EQ(word(sent("(0.001,0) [0|65] \"Hz\" EXCITER", "(0.01,0) [0|650] \"rpm\" EXCITER"), 0),
            12000);
  // Its range is in its own unit too: 0.9 g is too small for 9.8 m/s^2.
  const auto narrow =
      ExciterCodec::make(changed("[0|65] \"m/s^2\" EXCITER", "[0|0.9] \"g\" EXCITER"), settings());
  ASSERT_TRUE(narrow.ok()) << narrow.error().what;
  EXPECT_FALSE(narrow->setpoint({2.0, 9.80665, true, 1.0}, 0).ok());
  const auto told =
      ExciterCodec::make(changed("[0|65] \"m/s^2\" RIG", "[0|65] \"g\" RIG"), settings());
  ASSERT_TRUE(told.ok()) << told.error().what;
  EXPECT_NEAR(*told->status(status_frame(3), 5s)->amplitude, 9.81 * 9.80665, 1e-9);
}

TEST(CanExciterCodec, RefusesUnitsThatLeadNowhere) {
  EXPECT_EQ(refusal("[0|65] \"m/s^2\" EXCITER", "[0|65] \"m/s2\" EXCITER"), "accepted");
  EXPECT_EQ(refusal("[0|65] \"m/s^2\" EXCITER", "[0|65] \"\" EXCITER"), "accepted");
  EXPECT_THAT(refusal("[0|65] \"m/s^2\" EXCITER", "[0|65] \"mm\" EXCITER"),
              HasSubstr("signal amplitude of message exciter_setpoint is in \"mm\", which is no "
                        "unit of it; known are m/s^2"));
  EXPECT_THAT(refusal("[0|65] \"Hz\" EXCITER", "[0|65] \"1/s\" EXCITER"),
              HasSubstr("signal frequency of message exciter_setpoint is in \"1/s\""));
  EXPECT_THAT(refusal("[0|655] \"s\" EXCITER", "[0|655] \"msec\" EXCITER"), HasSubstr("ramp"));
  EXPECT_THAT(refusal("[0|65] \"m/s^2\" RIG", "[0|65] \"G\" RIG"),
              HasSubstr("signal amplitude of message exciter_status is in \"G\""));
}

TEST(CanExciterCodec, RefusesMasksBeyondItsSignal) {
  auto config = settings();
  config.status_ready = 0x8000;
  EXPECT_EQ(refusal("VERSION", "VERSION", config), "accepted");
  config.status_ready = 0x10000;
  EXPECT_THAT(refusal("VERSION", "VERSION", config),
              HasSubstr("status_ready 65536 has bits beyond the 16 bits"));
}

TEST(CanExciterCodec, WaitsForFivePeriodsOfTheStatus) {
  EXPECT_EQ(codec().status_limit(), 100ms);
}

TEST(CanExciterCodec, NamesAMissingSignal) {
  auto config = settings();
  config.setpoint_message = "exciter_status";
  const auto made = ExciterCodec::make(*load_dbc(SHAKER_TEST_DATA "/can/rig.dbc"), config);
  ASSERT_FALSE(made.ok());
  EXPECT_THAT(made.error().what, HasSubstr("exciter_status has no signal 'enable'"));
}

TEST(CanExciter, IsRefusedWhenItsMessageCannotSayStop) {
  const auto database = protocol::can::parse_dbc(
      "BO_ 1 set: 8 X\n SG_ frequency : 0|16@1+ (0.1,0) [0.5|50] \"Hz\" X\n"
      " SG_ amplitude : 16|16@1+ (0.1,0) [0|50] \"m/s^2\" X\n SG_ enable : 32|1@1+ (1,0) [0|1] "
      "\"\" X\n"
      "BO_ 2 get: 8 X\n SG_ status : 0|16@1+ (1,0) [0|0] \"\" X\n SG_ fault : 16|16@1+ (1,0) [0|0] "
      "\"\" X\n",
      "x.dbc");
  ASSERT_TRUE(database.ok()) << database.error().what;
  auto config = settings();
  config.setpoint_message = "set";
  config.status_message = "get";
  auto made = ExciterCodec::make(*database, config);
  ASSERT_TRUE(made.ok());
  EXPECT_THAT(made->setpoint({}, 0).error().what, HasSubstr("frequency 0 is outside 0.5 to 50 Hz"));
}

// On a machine with CAN the interface is missing; otherwise the kernel's CAN support is
// missing.
TEST(CanDevices, SayWhatIsMissingAndTheRemedy) {
  const RealClock clock;
  auto exciter = make_can_exciter(settings(), 0.1, SHAKER_TEST_DATA "/can", clock);
  ASSERT_TRUE(exciter.ok()) << exciter.error().what;
  const auto connected = (*exciter)->connect();
  ASSERT_FALSE(connected.ok());
  EXPECT_EQ(connected.error().kind, ErrorKind::unavailable);
  const auto remedy = testing::AnyOf(HasSubstr("this kernel has no CAN"),
                                     HasSubstr("there is no interface shakernone0"));
  EXPECT_THAT(connected.error().what, remedy);
  EXPECT_THAT((*exciter)->stop().error().what, HasSubstr("end by themselves 300 ms after"));
  EXPECT_FALSE((*exciter)->write({}).ok());

  config::CanSensor config;
  config.interface = "shakernone0";
  config.dbc = "rig.dbc";
  config.signals = {{protocol::Channel::displacement, "transducer_tpdo1", "position", 1.0, 0.0}};
  auto sensor = make_can_sensor(config, SHAKER_TEST_DATA "/can", clock);
  ASSERT_TRUE(sensor.ok()) << sensor.error().what;
  std::array<Sample, 4> out;
  EXPECT_FALSE((*sensor)->read(out, 1ms).ok());
  EXPECT_THAT((*sensor)->connect().error().what, remedy);
  EXPECT_THAT((*sensor)->health().trouble, remedy);
  EXPECT_FALSE((*sensor)->health().link_up);
}

TEST(CanDevices, AskForFdWhereAMessageNeedsIt) {
  config::CanSensor config;
  config.dbc = "rig.dbc";
  config.signals = {{protocol::Channel::displacement, "wide", "first", 1.0, 0.0}};
  const RealClock clock;
  const auto refused = make_can_sensor(config, SHAKER_TEST_DATA "/can", clock);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().what, HasSubstr("64 bytes"));
  EXPECT_THAT(refused.error().what, HasSubstr("\"fd\": true"));
  config.fd = true;
  EXPECT_TRUE(make_can_sensor(config, SHAKER_TEST_DATA "/can", clock).ok());
}

TEST(CanDevices, RefuseAPeriodThatTheKernelCannotKeep) {
  const RealClock clock;
  auto config = settings();
  config.period_s = 0.0;
  EXPECT_THAT(make_can_exciter(config, 0.1, SHAKER_TEST_DATA "/can", clock).error().what,
              HasSubstr("period_s is 0, allowed is 0.001 to 1"));
}

}  // namespace
}  // namespace shaker::drivers::can
