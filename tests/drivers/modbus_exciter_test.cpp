// The Modbus exciter against python3-pymodbus, over TCP and over RTU on a pseudo terminal.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/modbus/exciter.hpp"
#include "modbus_server.hpp"

namespace shaker::drivers::modbus {
namespace {

using namespace std::chrono_literals;
using protocol::modbus::RegisterSpec;
using protocol::modbus::RegisterTable;
using protocol::modbus::RegisterType;
using protocol::modbus::WordOrder;
using testing::HasSubstr;
using testing::StartsWith;
using Wire = ModbusServer::Wire;

RegisterSpec spec(int address, RegisterType type = RegisterType::u16, double scale = 1.0,
                  RegisterTable table = RegisterTable::holding) {
  RegisterSpec made;
  made.address = address;
  made.type = type;
  made.order = WordOrder::cdab;
  made.scale = scale;
  made.table = table;
  return made;
}

config::ModbusExciter drive(const config::ModbusLink& link) {
  config::ModbusExciter config;
  config.link = link;
  config.registers = {
      {"frequency", spec(100, RegisterType::f32)},
      {"amplitude", spec(102, RegisterType::f32)},
      {"enable", spec(104)},
      {"ramp", spec(105, RegisterType::u16, 0.1)},
      {"heartbeat", spec(106)},
      {"heartbeat_timeout", spec(107, RegisterType::u16, 0.01)},
      {"status", spec(200, RegisterType::u16, 1.0, RegisterTable::input)},
      {"fault", spec(201, RegisterType::u16, 1.0, RegisterTable::input)},
      {"amplitude_actual", spec(202, RegisterType::f32, 1.0, RegisterTable::input)}};
  config.registers.at("heartbeat").cyclic = true;
  return config;
}

constexpr Setpoint kDwell{2.5, 9.0, true, 2.0};  // 2.5f is 4020 0000, 9.0f is 4110 0000

class ModbusExciterWire : public testing::TestWithParam<Wire> {
 protected:
  std::unique_ptr<Exciter> make() {
    auto made = make_exciter(drive(server_.link()), clock_);
    EXPECT_TRUE(made) << (made ? "" : made.error().what);
    return std::move(*made);
  }
  std::unique_ptr<Exciter> connected() {
    auto exciter = make();
    EXPECT_TRUE(exciter->connect());
    return exciter;
  }

  ModbusServer server_{GetParam()};
  RealClock clock_;
};

INSTANTIATE_TEST_SUITE_P(Modbus, ModbusExciterWire, testing::Values(Wire::tcp, Wire::rtu),
                         [](const auto& wire) { return wire.param == Wire::tcp ? "Tcp" : "Rtu"; });

TEST_P(ModbusExciterWire, WritesSetpointsWholeAndEnablesLast) {
  auto exciter = connected();
  const Result<void> written = exciter->write(kDwell);
  ASSERT_TRUE(written) << written.error().what;
  EXPECT_EQ(server_.order("get 100 6"), "0000 4020 0000 4110 0001 0014");
  EXPECT_EQ(server_.order("log"), "16:100=0000,4020,0000,4110 6:105=0014 6:104=0001");
}

TEST_P(ModbusExciterWire, WritesOnlyWhatChanged) {
  auto exciter = connected();
  ASSERT_TRUE(exciter->write(kDwell));
  server_.order("log");
  ASSERT_TRUE(exciter->write(kDwell));
  EXPECT_EQ(server_.order("log"), "");
  Setpoint next = kDwell;
  next.amplitude = 9.5;
  ASSERT_TRUE(exciter->write(next));
  EXPECT_EQ(server_.order("log"), "16:102=0000,4118") << "both halves, and nothing else";
  next.enable = false;
  next.frequency_hz = 3.0;
  ASSERT_TRUE(exciter->write(next));
  EXPECT_EQ(server_.order("log"), "6:104=0000 16:100=0000,4040") << "disabled before all else";
}

// A register may be an EEPROM cell: a reconnection must not rewrite it.
TEST_P(ModbusExciterWire, DoesNotRewriteWhatTheDeviceAlreadyHolds) {
  ASSERT_TRUE(connected()->write(kDwell));
  server_.order("log");
  auto again = connected();
  ASSERT_TRUE(again->write(kDwell));
  EXPECT_EQ(server_.order("log"), "");
}

TEST_P(ModbusExciterWire, SaysWhenTheDeviceHoldsSomethingElse) {
  server_.order("clamp 105 000A");
  auto exciter = connected();
  const Result<void> written = exciter->write(kDwell);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::refused);
  EXPECT_THAT(written.error().what, HasSubstr("ramp was written as 2 but reads back as 1"));
  EXPECT_EQ(server_.order("get 104"), "0000") << "not enabled on a setpoint that is not there";
  EXPECT_FALSE(exciter->write(kDwell)) << "and it is not forgotten";
}

TEST_P(ModbusExciterWire, OneStepOffIsNotWhatWasWritten) {
  server_.order("clamp 104 0000");
  const Result<void> written = connected()->write(kDwell);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().what, HasSubstr("enable was written as 1 but reads back as 0"));
}

TEST_P(ModbusExciterWire, RefusesASetpointThatDoesNotFitItsRegisterAndWritesNothing) {
  auto exciter = connected();
  Setpoint setpoint = kDwell;
  setpoint.ramp_s = 7000.0;
  const Result<void> written = exciter->write(setpoint);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().what, HasSubstr("ramp: register 105: 7000 does not fit its u16"));
  EXPECT_EQ(server_.order("log"), "");
}

TEST_P(ModbusExciterWire, ReadsStatusFaultAndWhatTheDeviceDoes) {
  auto exciter = connected();
  server_.order("input 200 0003 0000 0000 4110");
  server_.order("set 107 0032");
  Result<ExciterStatus> status = exciter->read();
  ASSERT_TRUE(status) << status.error().what;
  EXPECT_TRUE(status->ready);
  EXPECT_TRUE(status->running);
  EXPECT_EQ(status->fault, 0U);
  EXPECT_EQ(status->amplitude, 9.0);
  EXPECT_EQ(status->heartbeat_timeout_s, 0.5);
  EXPECT_FALSE(status->frequency_hz) << "not in this map";
  server_.order("input 200 0002 0017 0000 7FC0");
  status = exciter->read();
  ASSERT_TRUE(status);
  EXPECT_FALSE(status->ready) << "not with a fault, whatever the ready bit says";
  EXPECT_FALSE(status->running);
  EXPECT_EQ(status->fault, 0x17U);
  EXPECT_FALSE(status->amplitude) << "not a number is no amplitude";
}

TEST_P(ModbusExciterWire, CountsTheHeartbeat) {
  auto exciter = connected();
  for (int i = 0; i < 3; ++i)
    ASSERT_TRUE(exciter->heartbeat());
  EXPECT_EQ(server_.order("log"), "6:106=0001 6:106=0002 6:106=0003");
}

TEST_P(ModbusExciterWire, StopsAtOnceWithoutARamp) {
  auto exciter = connected();
  ASSERT_TRUE(exciter->write(kDwell));
  server_.order("log");
  ASSERT_TRUE(exciter->stop());
  EXPECT_EQ(server_.order("log"), "6:104=0000 16:102=0000,0000");
  ASSERT_TRUE(exciter->stop());
  EXPECT_EQ(server_.order("log"), "6:104=0000 16:102=0000,0000") << "a stop is never spared";
}

TEST_P(ModbusExciterWire, ConnectsForAStopIfItMust) {
  ASSERT_TRUE(connected()->write(kDwell));
  auto stranger = make();
  ASSERT_TRUE(stranger->stop());
  EXPECT_EQ(server_.order("get 102 3"), "0000 0000 0000");
}

TEST_P(ModbusExciterWire, StopsThoughAnAnswerIsMissed) {
  auto exciter = connected();
  ASSERT_TRUE(exciter->write(kDwell));
  server_.order("mute 1");
  const Result<void> stopped = exciter->stop();
  ASSERT_TRUE(stopped) << stopped.error().what;
  EXPECT_EQ(server_.order("get 102 3"), "0000 0000 0000");
}

TEST_P(ModbusExciterWire, SaysWhenAStopIsNotObeyed) {
  server_.order("clamp 104 0001");
  auto exciter = connected();
  const Result<void> stopped = exciter->stop();
  ASSERT_FALSE(stopped);
  EXPECT_THAT(stopped.error().what, HasSubstr("enable was written as 0 but reads back as 1"));
  EXPECT_EQ(server_.order("get 102 2"), "0000 0000") << "the amplitude went to zero all the same";
}

TEST(ModbusExciterRecovery, KnowsNothingOfADeviceThatWasRestartedTwice) {
  ModbusServer server(Wire::tcp);
  RealClock clock;
  auto made = make_exciter(drive(server.link()), clock);
  ASSERT_TRUE(made);
  Exciter& exciter = **made;
  for (int round = 0; round < 3; ++round) {
    const Nanoseconds latest = clock.now() + 20s;
    while (!exciter.connect() && clock.now() < latest)
      clock.sleep_until(clock.now() + 5ms);
    ASSERT_TRUE(exciter.write(kDwell));
    EXPECT_EQ(server.order("get 100 6"), "0000 4020 0000 4110 0001 0014");
    server.kill();
    EXPECT_FALSE(exciter.write({1.0, 1.0, true, 1.0}));
    EXPECT_FALSE(exciter.stop()) << "nobody is there to stop";
    server.restart();
  }
}

TEST(ModbusExciterMap, IsRefusedWithTheRoleAndTheRemedy) {
  RealClock clock;
  const auto refusal = [&](auto change) {
    config::ModbusExciter config = drive({});
    change(config.registers);
    const auto made = make_exciter(config, clock);
    return made ? std::string("accepted") : made.error().what;
  };
  using Map = std::map<std::string, RegisterSpec>;
  EXPECT_EQ(refusal([](Map&) {}), "accepted");
  EXPECT_THAT(refusal([](Map& m) { m.erase("fault"); }), StartsWith("registers.fault: is missing"));
  EXPECT_THAT(refusal([](Map& m) { m["speed"] = spec(300); }),
              StartsWith("registers.speed: no such role; allowed are frequency"));
  EXPECT_THAT(refusal([](Map& m) { m["enable"].address = 103; }),
              HasSubstr("register 103 is part of two values"));
  EXPECT_THAT(refusal([](Map& m) { m["enable"].table = RegisterTable::input; }),
              HasSubstr("registers.enable: is written, so it must be a holding register"));
  EXPECT_THAT(refusal([](Map& m) { m["status"].type = RegisterType::f32; }),
              HasSubstr("registers.status: is a set of bits"));
  EXPECT_THAT(refusal([](Map& m) { m["heartbeat"].cyclic = false; }),
              HasSubstr("must be marked \"cyclic\": true"));
  EXPECT_THAT(refusal([](Map& m) {
                m["amplitude"].type = RegisterType::u16;
                m["amplitude"].offset = 1.0;
              }),
              HasSubstr("registers.amplitude: register 102: 0 does not fit"));
  EXPECT_THAT(refusal([](Map& m) { m["ramp"].address = 65536; }),
              HasSubstr("registers.ramp: register address 65536"));
}

}  // namespace
}  // namespace shaker::drivers::modbus
