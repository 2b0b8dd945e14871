// The Modbus sensor against python3-pymodbus.
#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/modbus/sensor.hpp"
#include "modbus_server.hpp"
#include "tests/estimator/counting_allocator.hpp"

namespace shaker::drivers::modbus {
namespace {

using namespace std::chrono_literals;
using protocol::Channel;
using protocol::modbus::RegisterTable;
using protocol::modbus::RegisterType;
using protocol::modbus::WordOrder;
using testing::HasSubstr;
using Wire = ModbusServer::Wire;

config::ModbusSensor transducer(const config::ModbusLink& link) {
  config::ModbusSensor config;
  config.link = link;
  auto& stroke = config.registers[Channel::displacement];
  stroke.table = RegisterTable::input;
  stroke.address = 0;
  stroke.type = RegisterType::i32;
  stroke.scale = 1e-6;
  auto& table = config.registers[Channel::excitation];
  table.table = RegisterTable::input;
  table.address = 2;
  table.type = RegisterType::f32;
  config.rate_hz = 200.0;
  return config;
}

class ModbusSensorWire : public testing::TestWithParam<Wire> {
 protected:
  ModbusServer server_{GetParam()};
  RealClock clock_;
  std::array<Sample, 8> out_;
};

INSTANTIATE_TEST_SUITE_P(Modbus, ModbusSensorWire, testing::Values(Wire::tcp, Wire::rtu),
                         [](const auto& wire) { return wire.param == Wire::tcp ? "Tcp" : "Rtu"; });

TEST_P(ModbusSensorWire, ReadsItsChannelsInOneBlockAndStampsThemAlike) {
  server_.order("input 0 FFFF FFF6 4110 0000");  // -10 um, 9.0 m/s^2
  auto sensor = make_sensor(transducer(server_.link()), clock_);
  ASSERT_TRUE(sensor);
  ASSERT_TRUE((*sensor)->connect());
  const Nanoseconds before = clock_.now();
  const Result<std::size_t> got = (*sensor)->read(out_, 5s);
  const Nanoseconds after = clock_.now();
  ASSERT_TRUE(got) << got.error().what;
  ASSERT_EQ(*got, 2U);
  EXPECT_EQ(out_[0].channel, Channel::displacement);
  EXPECT_DOUBLE_EQ(out_[0].value, -10e-6);
  EXPECT_EQ(out_[1].channel, Channel::excitation);
  EXPECT_EQ(out_[1].value, 9.0);
  EXPECT_EQ(out_[0].quality, Quality::good);
  EXPECT_EQ(out_[0].t, out_[1].t);
  EXPECT_GT(out_[0].t, before);
  EXPECT_LT(out_[0].t, after);
}

TEST_P(ModbusSensorWire, DoesNotAllocateWhileItReads) {
  auto sensor = make_sensor(transducer(server_.link()), clock_);
  ASSERT_TRUE(sensor);
  ASSERT_TRUE((*sensor)->connect());
  ASSERT_EQ(*(*sensor)->read(out_, 5s), 2U);
  const long before = estimator::testing::allocation_count();
  std::size_t got = 0;
  for (int i = 0; i < 20; ++i)
    got += *(*sensor)->read(out_, 5s);
  EXPECT_EQ(estimator::testing::allocation_count() - before, 0);
  EXPECT_EQ(got, 40U);
}

TEST_P(ModbusSensorWire, MarksWhatIsNotANumberAsBad) {
  auto sensor = make_sensor(transducer(server_.link()), clock_);
  ASSERT_TRUE(sensor);
  ASSERT_TRUE((*sensor)->connect());
  for (const char* words : {"7FC0 0000", "7F80 0000", "FF80 0000"}) {
    server_.order(std::string("input 2 ") + words);
    ASSERT_EQ(*(*sensor)->read(out_, 5s), 2U);
    EXPECT_EQ(out_[0].quality, Quality::good);
    EXPECT_EQ(out_[1].quality, Quality::bad) << words;
  }
}

TEST_P(ModbusSensorWire, CountsAMissedAnswerAndAnExceptionAndGoesOn) {
  config::ModbusSensor config = transducer(server_.link());
  config.link.response_timeout_s = 0.2;
  auto made = make_sensor(config, clock_);
  ASSERT_TRUE(made);
  Sensor& sensor = **made;
  ASSERT_TRUE(sensor.connect());
  server_.order("exception 4 1");
  EXPECT_EQ(*sensor.read(out_, 5s), 0U);
  EXPECT_THAT(sensor.health().trouble, HasSubstr("Modbus exception 04"));
  server_.order("mute 1");
  EXPECT_EQ(*sensor.read(out_, 5s), 0U);
  EXPECT_THAT(sensor.health().trouble, HasSubstr("no answer within 200 ms"));
  EXPECT_EQ(sensor.health().errors, 2U);
  const Nanoseconds latest = clock_.now() + 10s;
  std::size_t got = 0;
  while (got == 0 && clock_.now() < latest)
    got = *sensor.read(out_, 1s);
  EXPECT_EQ(got, 2U);
  EXPECT_GT(sensor.health().lost, 20U) << "a timeout of 200 ms covers forty polls";
  EXPECT_EQ(sensor.health().trouble, "");
}

// 40 ms on the device's clock, even if the second sample is read late.
TEST_P(ModbusSensorWire, StampsWithTheDevicesClockAndGivesASampleOnce) {
  config::ModbusSensor config = transducer(server_.link());
  config.timestamp = {
      .table = RegisterTable::input, .address = 4, .type = RegisterType::u16, .unit = "ms"};
  config.rate_hz = 200.0;
  auto made = make_sensor(config, clock_);
  ASSERT_TRUE(made) << made.error().what;
  Sensor& sensor = **made;
  EXPECT_EQ(sensor.stamp_source(), StampSource::device);
  ASSERT_TRUE(sensor.connect());
  server_.order("input 4 FFF0");
  ASSERT_EQ(*sensor.read(out_, 5s), 2U);
  const Nanoseconds first = out_[0].t;
  EXPECT_EQ(out_[1].t, first);
  EXPECT_LE(first, clock_.now());
  EXPECT_EQ(*sensor.read(out_, 5s), 0U) << "the device has no new sample";
  EXPECT_EQ(sensor.health().samples, 2U);
  EXPECT_EQ(sensor.health().trouble, "");
  clock_.sleep_until(first + 60ms);
  server_.order("input 4 0018");  // past the wrap
  ASSERT_EQ(*sensor.read(out_, 5s), 2U);
  EXPECT_NEAR(seconds(out_[0].t - first), 0.040, 1e-6);
}

TEST(ModbusSensor, ReturnsWithinTheTimeoutBetweenPolls) {
  ModbusServer server(Wire::tcp);
  RealClock clock;
  config::ModbusSensor config = transducer(server.link());
  config.rate_hz = 0.5;
  auto sensor = make_sensor(config, clock);
  ASSERT_TRUE(sensor);
  ASSERT_TRUE((*sensor)->connect());
  std::array<Sample, 2> out;
  EXPECT_EQ(*(*sensor)->read(out, 10ms), 2U);
  const Nanoseconds before = clock.now();
  EXPECT_EQ(*(*sensor)->read(out, 10ms), 0U);
  EXPECT_GE(clock.now() - before, 10ms);
  EXPECT_LT(clock.now() - before, 1s);
}

// Polls on its own deadlines of the clock, not of the reader: the duration of the polls does
// not change the mean rate.
TEST(ModbusSensor, PollsOnAbsoluteDeadlines) {
  ModbusServer server(Wire::tcp);
  RealClock clock;
  auto made = make_sensor(transducer(server.link()), clock);
  ASSERT_TRUE(made);
  Sensor& sensor = **made;
  ASSERT_TRUE(sensor.connect());
  const Nanoseconds start = clock.now();
  std::array<Sample, 2> out;
  for (int i = 0; i < 100; ++i)
    ASSERT_TRUE(sensor.read(out, 1s));
  const double polls = seconds(clock.now() - start) * 200.0;
  const auto health = sensor.health();
  EXPECT_NEAR(polls, 99.0 + static_cast<double>(health.lost) / 2.0, 4.0);
}

TEST(ModbusSensor, SaysThatTheLinkIsGoneAndRecoversTwice) {
  ModbusServer server(Wire::tcp);
  RealClock clock;
  auto made = make_sensor(transducer(server.link()), clock);
  ASSERT_TRUE(made);
  Sensor& sensor = **made;
  std::array<Sample, 2> out;
  ASSERT_TRUE(sensor.connect());
  for (int round = 1; round <= 2; ++round) {
    EXPECT_EQ(*sensor.read(out, 5s), 2U);
    server.kill();
    Result<std::size_t> got = std::size_t{0};
    const Nanoseconds latest = clock.now() + 20s;
    while (got && clock.now() < latest)
      got = sensor.read(out, 100ms);
    ASSERT_FALSE(got);
    EXPECT_FALSE(sensor.health().link_up);
    server.restart();
    while (!sensor.connect() && clock.now() < latest)
      clock.sleep_until(clock.now() + 5ms);
    EXPECT_TRUE(sensor.health().link_up);
    EXPECT_EQ(sensor.health().reconnects, static_cast<std::uint64_t>(round));
  }
}

TEST(ModbusSensor, RefusesSettingsThatMakeNoSense) {
  RealClock clock;
  config::ModbusSensor config;
  EXPECT_THAT(make_sensor(config, clock).error().what, HasSubstr("at least one channel"));
  config = transducer({});
  config.rate_hz = 0.0;
  EXPECT_THAT(make_sensor(config, clock).error().what, HasSubstr("rate_hz 0 must be above 0"));
  config.rate_hz = 10.0;
  config.registers[Channel::excitation].scale = 0.0;
  EXPECT_THAT(make_sensor(config, clock).error().what, HasSubstr("registers.excitation: "));
}

TEST(ModbusSensor, RefusesATimeStampThatCannotBeTrusted) {
  RealClock clock;
  config::ModbusSensor config = transducer({});
  const auto refusal = [&](int address, RegisterType type, const char* unit) {
    config.timestamp = {
        .table = RegisterTable::input, .address = address, .type = type, .unit = unit};
    const auto made = make_sensor(config, clock);
    return made ? std::string("none") : made.error().what;
  };
  EXPECT_EQ(refusal(4, RegisterType::u32, "us"), "none");
  EXPECT_THAT(refusal(5, RegisterType::u32, "us"), HasSubstr("not read in one request"));
  EXPECT_THAT(refusal(4, RegisterType::u16, "us"), HasSubstr("wraps every 0.0655 s"));
  EXPECT_THAT(refusal(4, RegisterType::f32, "us"), HasSubstr("must be u16 or u32"));
  EXPECT_THAT(refusal(4, RegisterType::u32, "min"), HasSubstr("must be us, ms or s"));
  EXPECT_THAT(refusal(65535, RegisterType::u32, "us"), HasSubstr("registers.timestamp: "));
}

}  // namespace
}  // namespace shaker::drivers::modbus
