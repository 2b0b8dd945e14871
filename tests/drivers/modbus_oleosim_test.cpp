// The Modbus drivers against the controller of the virtual rig, which has an independent
// register codec.
#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <modbus.h>
#include <sys/wait.h>
#include <unistd.h>

#include "drivers/modbus/exciter.hpp"
#include "drivers/modbus/sensor.hpp"

namespace shaker::drivers::modbus {
namespace {

using namespace std::chrono_literals;
using protocol::Channel;
using protocol::modbus::RegisterSpec;
using protocol::modbus::RegisterTable;
using protocol::modbus::RegisterType;

class Oleosim {
 public:
  // `fault`: an entry of its script, such as "exciter_trip@0".
  explicit Oleosim(const char* fault = nullptr) {
    int up[2];
    EXPECT_EQ(::pipe(up), 0);
    child_ = ::fork();
    if (child_ == 0) {
      ::dup2(up[1], STDOUT_FILENO);
      ::close(up[0]);
      ::close(up[1]);
      ::execl(OLEOSIM, OLEOSIM, "--port", "0", fault ? "--fault" : nullptr, fault, nullptr);
      ::_exit(127);
    }
    ::close(up[1]);
    char letter = 0;
    while (::read(up[0], &letter, 1) == 1 && letter != '\n')
      greeting_ += letter;
    output_ = up[0];
  }
  Oleosim(const Oleosim&) = delete;
  Oleosim& operator=(const Oleosim&) = delete;
  ~Oleosim() {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
    ::close(output_);
  }
  config::ModbusLink link() const {
    const std::string ready = "ready port=";
    EXPECT_EQ(greeting_.rfind(ready, 0), 0U) << greeting_;
    config::ModbusLink link;
    link.transport = config::ModbusTcp{"127.0.0.1", std::stoi(greeting_.substr(ready.size()))};
    link.response_timeout_s = 1.0;
    return link;
  }

 private:
  pid_t child_ = -1;
  int output_ = -1;
  std::string greeting_;
};

RegisterSpec spec(RegisterTable table, int address, RegisterType type) {
  RegisterSpec made;
  made.table = table;
  made.address = address;
  made.type = type;
  return made;
}

// The registers of sim/README.md.
config::ModbusExciter controller(const config::ModbusLink& link) {
  config::ModbusExciter config;
  config.link = link;
  constexpr auto holding = RegisterTable::holding, input = RegisterTable::input;
  config.registers = {{"frequency", spec(holding, 0, RegisterType::f32)},
                      {"amplitude", spec(holding, 2, RegisterType::f32)},
                      {"enable", spec(holding, 4, RegisterType::u16)},
                      {"ramp", spec(holding, 5, RegisterType::f32)},
                      {"heartbeat", spec(holding, 7, RegisterType::u16)},
                      {"heartbeat_timeout", spec(holding, 8, RegisterType::f32)},
                      {"status", spec(input, 0, RegisterType::u16)},
                      {"fault", spec(input, 1, RegisterType::u16)},
                      {"frequency_actual", spec(input, 2, RegisterType::f32)},
                      {"amplitude_actual", spec(input, 4, RegisterType::f32)}};
  config.registers.at("heartbeat").cyclic = true;
  return config;
}

TEST(ModbusAgainstTheVirtualRig, ClearsATripOnlyWhereTheMapHasAnOrderForIt) {
  Oleosim rig("exciter_trip@0");
  RealClock clock;
  auto config = controller(rig.link());
  auto without = make_exciter(config, clock);
  ASSERT_TRUE(without) << without.error().what;
  ASSERT_TRUE((*without)->connect());
  EXPECT_EQ((*without)->read()->fault, 2u);
  EXPECT_TRUE((*without)->clear_fault());
  EXPECT_EQ((*without)->read()->fault, 2u);
  config.registers["fault_reset"] = spec(RegisterTable::holding, 10, RegisterType::u16);
  auto with = make_exciter(config, clock);
  ASSERT_TRUE(with) << with.error().what;
  ASSERT_TRUE((*with)->connect());
  EXPECT_TRUE((*with)->clear_fault());
  EXPECT_EQ((*with)->read()->fault, 0u);
}

// Writes from the rig file to the register, which libmodbus reads back: a value whose unit in
// the file is g is written in g.
TEST(ModbusAgainstTheVirtualRig, WritesTheUnitThatTheRigFileStates) {
  Oleosim sim;
  RealClock clock;
  const int port = std::get<config::ModbusTcp>(sim.link().transport).port;
  const auto rig =
      config::parse_rig(fmt::format(R"({{"name": "r", "sensors": [{{"kind": "modbus", "registers":
        {{"displacement": {{"table": "input", "address": 6, "type": "f32", "unit": "mm"}}}},
        "link": {{"transport": {{"kind": "tcp", "host": "127.0.0.1", "port": {0}}}}}}}],
        "exciter": {{"device": {{"kind": "modbus",
          "link": {{"transport": {{"kind": "tcp", "host": "127.0.0.1", "port": {0}}}}},
          "registers": {{
            "frequency": {{"address": 0, "type": "f32", "unit": "rpm"}},
            "amplitude": {{"address": 2, "type": "f32", "unit": "g", "scale": 0.1}},
            "enable": {{"address": 4, "type": "u16"}},
            "ramp": {{"address": 5, "type": "f32", "unit": "ms"}},
            "heartbeat": {{"address": 7, "type": "u16", "cyclic": true}},
            "status": {{"table": "input", "address": 0, "type": "u16"}},
            "fault": {{"table": "input", "address": 1, "type": "u16"}}}}}}}}}})",
                                    port),
                        "r.json");
  ASSERT_TRUE(rig) << rig.error().what;
  auto exciter = make_exciter(std::get<config::ModbusExciter>(rig->exciter.device), clock);
  ASSERT_TRUE(exciter) << exciter.error().what;
  ASSERT_TRUE((*exciter)->connect());
  const auto written = (*exciter)->write({0.5, 0.0980665, true, 0.3});
  ASSERT_TRUE(written) << written.error().what;

  modbus_t* raw = ::modbus_new_tcp("127.0.0.1", port);
  ASSERT_EQ(::modbus_connect(raw), 0);
  ::modbus_set_slave(raw, 1);
  std::array<std::uint16_t, 8> registers{};
  EXPECT_EQ(::modbus_read_registers(raw, 0, 8, registers.data()), 8);
  ::modbus_close(raw);
  ::modbus_free(raw);
  EXPECT_FLOAT_EQ(::modbus_get_float_abcd(registers.data()), 30.0F);       // rpm
  EXPECT_FLOAT_EQ(::modbus_get_float_abcd(registers.data() + 2), 0.1F);    // tenths of g
  EXPECT_FLOAT_EQ(::modbus_get_float_abcd(registers.data() + 5), 300.0F);  // ms
  const auto& stroke = std::get<config::ModbusSensor>(rig->sensors.at(0)).registers;
  EXPECT_DOUBLE_EQ(stroke.at(Channel::displacement).scale, 1e-3);
}

TEST(ModbusAgainstTheVirtualRig, ShakesWhileTheHeartbeatBeatsAndStopsWithoutIt) {
  Oleosim rig;
  RealClock clock;
  auto made = make_exciter(controller(rig.link()), clock);
  ASSERT_TRUE(made) << made.error().what;
  Exciter& exciter = **made;
  ASSERT_TRUE(exciter.connect());
  EXPECT_EQ(exciter.read()->heartbeat_timeout_s, 0.5);
  const Result<void> written = exciter.write({5.0, 3.0, true, 0.1});
  ASSERT_TRUE(written) << written.error().what;

  config::ModbusSensor transducer;
  transducer.link = rig.link();
  transducer.rate_hz = 200.0;
  transducer.registers[Channel::displacement] = spec(RegisterTable::input, 6, RegisterType::f32);
  transducer.registers[Channel::excitation] = spec(RegisterTable::input, 8, RegisterType::f32);
  auto sensor = make_sensor(transducer, clock);
  ASSERT_TRUE(sensor) << sensor.error().what;
  ASSERT_TRUE((*sensor)->connect());

  std::vector<Sample> out(2);
  double low = 0.0, high = 0.0;
  for (int poll = 0; poll < 160; ++poll) {
    if (poll % 10 == 0) {
      ASSERT_TRUE(exciter.heartbeat());
    }
    ASSERT_TRUE((*sensor)->read(out, 1s));
    low = std::min(low, out[1].value);
    high = std::max(high, out[1].value);
  }
  EXPECT_NEAR(high, 3.0, 0.2);
  EXPECT_NEAR(low, -3.0, 0.2);
  Result<ExciterStatus> status = exciter.read();
  ASSERT_TRUE(status);
  EXPECT_TRUE(status->running);
  EXPECT_TRUE(status->ready);
  EXPECT_EQ(status->frequency_hz, 5.0);

  const Nanoseconds latest = clock.now() + 20s;  // without a heartbeat
  while (status->running && clock.now() < latest) {
    clock.sleep_until(clock.now() + 20ms);
    status = exciter.read();
    ASSERT_TRUE(status);
  }
  EXPECT_FALSE(status->running);
  EXPECT_TRUE(exciter.stop());
}

// The rig samples on its own grid of one millisecond. The daemon's stamps must lie on such a
// grid too, whenever the polls come. Stamps of the host would contain the lateness of the
// polls.
TEST(ModbusAgainstTheVirtualRig, StampsOnTheRigsOwnGrid) {
  Oleosim rig;
  RealClock clock;
  config::ModbusSensor transducer;
  transducer.link = rig.link();
  transducer.rate_hz = 250.0;
  transducer.registers[Channel::displacement] = spec(RegisterTable::input, 6, RegisterType::f32);
  transducer.registers[Channel::excitation] = spec(RegisterTable::input, 8, RegisterType::f32);
  transducer.timestamp = spec(RegisterTable::input, 10, RegisterType::u32);
  transducer.timestamp->unit = "us";
  auto sensor = make_sensor(transducer, clock);
  ASSERT_TRUE(sensor) << sensor.error().what;
  ASSERT_TRUE((*sensor)->connect());
  std::vector<Sample> out(2);
  std::vector<double> steps_ms;
  Nanoseconds before{};
  while (steps_ms.size() < 500) {
    const auto got = (*sensor)->read(out, 1s);
    ASSERT_TRUE(got) << got.error().what;
    if (*got == 0) continue;
    EXPECT_EQ(out[0].t, out[1].t);
    EXPECT_GT(out[0].t, before);
    EXPECT_LE(out[0].t, clock.now());
    steps_ms.push_back(1e3 * seconds(out[0].t - before));
    before = out[0].t;
  }
  const auto on_grid = std::ranges::count_if(
      steps_ms, [](double ms) { return std::abs(ms - std::round(ms)) < 0.05; });
  EXPECT_GT(on_grid, 400);
}

TEST(ModbusAgainstTheVirtualRig, StopsItAtOnce) {
  Oleosim rig;
  RealClock clock;
  auto made = make_exciter(controller(rig.link()), clock);
  ASSERT_TRUE(made) << made.error().what;
  Exciter& exciter = **made;
  ASSERT_TRUE(exciter.connect());
  ASSERT_TRUE(exciter.write({5.0, 3.0, true, 60.0}));
  ASSERT_TRUE(exciter.heartbeat());
  EXPECT_TRUE(exciter.read()->running);
  const Result<void> stopped = exciter.stop();
  ASSERT_TRUE(stopped) << stopped.error().what;
  const Result<ExciterStatus> status = exciter.read();
  ASSERT_TRUE(status);
  EXPECT_FALSE(status->running) << "not even a ramp of a minute holds it up";
  EXPECT_EQ(status->amplitude, 0.0);
}

TEST(ModbusAgainstTheVirtualRig, HearsItsRefusalOfAFrequencyBeyondItsLimit) {
  Oleosim rig;
  RealClock clock;
  auto made = make_exciter(controller(rig.link()), clock);
  ASSERT_TRUE(made) << made.error().what;
  ASSERT_TRUE((*made)->connect());
  const Result<void> written = (*made)->write({1e6, 3.0, true, 0.1});
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().what, testing::HasSubstr("Modbus exception 03"));
  EXPECT_FALSE((*made)->read()->running);
}

}  // namespace
}  // namespace shaker::drivers::modbus
