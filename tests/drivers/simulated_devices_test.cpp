#include "drivers/sim/simulated_devices.hpp"

#include <array>
#include <cmath>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/factory.hpp"

namespace shaker::drivers::sim {
namespace {

using namespace std::chrono_literals;
using protocol::Channel;
using shaker::sim::Fault;

config::RigConfig simulated_rig() {
  config::RigConfig rig;
  rig.exciter.device = config::SimulatedExciter{};
  rig.sensors.emplace_back(config::SimulatedSensor{});
  return rig;
}

struct Bench {
  explicit Bench(shaker::sim::RigOptions options = {})
      : rig(std::make_shared<SimulatedRig>(options, clock)), exciter(rig), sensor(rig) {}
  SimulatedClock clock;
  std::shared_ptr<SimulatedRig> rig;
  SimulatedExciter exciter;
  SimulatedSensor sensor;
  std::array<Sample, 4096> samples{};
};

TEST(SimulatedDevices, OfTheFactoryShareOneRig) {
  SimulatedClock clock;
  auto devices = make_devices(simulated_rig(), clock);
  ASSERT_TRUE(devices) << devices.error().what;
  ASSERT_EQ(devices->sensors.size(), 1u);
  ASSERT_TRUE(devices->exciter->connect());
  ASSERT_TRUE(devices->sensors[0]->connect());
  ASSERT_TRUE(devices->exciter->write({2.0, 3.0, true, 0.0}));
  std::array<Sample, 400> samples{};
  clock.advance(100ms);
  const auto n = devices->sensors[0]->read(samples, 0ns);
  ASSERT_TRUE(n);
  ASSERT_EQ(*n, 200u);
  double largest = 0.0;
  for (const auto& s : samples) {
    if (s.channel == Channel::excitation) largest = std::max(largest, s.value);
  }
  EXPECT_NEAR(largest, 3.0, 0.05);
}

TEST(SimulatedDevices, OfTheFactoryAreOnePair) {
  SimulatedClock clock;
  auto two = simulated_rig();
  two.sensors.emplace_back(config::SimulatedSensor{});
  ASSERT_FALSE(make_devices(two, clock));
  auto none = simulated_rig();
  none.sensors.clear();
  ASSERT_FALSE(make_devices(none, clock));
  auto wrong = simulated_rig();
  std::get<config::SimulatedSensor>(wrong.sensors[0]).plant = "tyre";
  const auto devices = make_devices(wrong, clock);
  ASSERT_FALSE(devices);
  EXPECT_THAT(devices.error().what, testing::HasSubstr("plant 'tyre' is unknown"));
}

TEST(SimulatedSensor, GivesBothChannelsStampedOnTheDaemonsClock) {
  Bench bench;
  bench.clock.advance(10s);
  ASSERT_TRUE(bench.sensor.connect());
  bench.clock.advance(50ms);
  const auto n = bench.sensor.read(bench.samples, 0ns);
  ASSERT_TRUE(n);
  ASSERT_EQ(*n, 100u);
  EXPECT_EQ(bench.samples[0].t, 10s + 1ms);
  EXPECT_EQ(bench.samples[99].t, 10s + 50ms);
  EXPECT_EQ(bench.samples[0].channel, Channel::displacement);
  EXPECT_EQ(bench.samples[1].channel, Channel::excitation);
  EXPECT_EQ(*bench.sensor.read(bench.samples, 0ns), 0u);
}

TEST(SimulatedSensor, GivesTheAuxiliaryQuantitiesOnTheChannelsThatTheRigFileNames) {
  auto rig = simulated_rig();
  auto& simulated = std::get<config::SimulatedSensor>(rig.sensors[0]);
  simulated.auxiliary = {{Channel::aux3, "oil_temperature"}, {Channel::aux5, "table_velocity"}};
  SimulatedClock clock;
  const auto devices = make_devices(rig, clock);
  ASSERT_TRUE(devices) << devices.error().what;
  auto& sensor = *devices->sensors[0];
  EXPECT_THAT(sensor.channels(), testing::ElementsAre(Channel::displacement, Channel::excitation,
                                                      Channel::aux3, Channel::aux5));
  ASSERT_TRUE(sensor.connect());
  clock.advance(10ms);
  std::array<Sample, 7> samples{};  // room for the samples of one instant only: it is not split
  ASSERT_EQ(*sensor.read(samples, 0ns), 4u);
  EXPECT_EQ(samples[2].channel, Channel::aux3);
  EXPECT_NEAR(samples[2].value, 20.0, 0.2);
  EXPECT_EQ(samples[3].channel, Channel::aux5);
  EXPECT_NEAR(samples[3].value, 0.0, 1e-3);
}

TEST(SimulatedSensor, IsAsNoisyAsTheRigFileSays) {
  auto rig = simulated_rig();
  auto& sensor = std::get<config::SimulatedSensor>(rig.sensors[0]);
  sensor.noise_m = 1e-3;
  sensor.noise_m_s2 = 0.5;
  SimulatedClock clock;
  const auto devices = make_devices(rig, clock);
  ASSERT_TRUE(devices) << devices.error().what;
  ASSERT_TRUE(devices->sensors[0]->connect());
  clock.advance(2s);
  std::array<Sample, 4000> samples{};
  ASSERT_EQ(*devices->sensors[0]->read(samples, 0ns), 4000u);
  for (const Channel channel : {Channel::displacement, Channel::excitation}) {
    double sum = 0.0, square = 0.0;
    for (const auto& s : samples) {
      if (s.channel != channel) continue;
      sum += s.value / 2000.0;
      square += s.value * s.value / 2000.0;
    }
    const double wanted = channel == Channel::displacement ? 1e-3 : 0.5;
    EXPECT_NEAR(std::sqrt(square - sum * sum) / wanted, 1.0, 0.1);
  }
}

TEST(SimulatedSensor, JittersAsTheRigFileSays) {
  for (const double jitter : {0.0, 0.2}) {
    auto rig = simulated_rig();
    std::get<config::SimulatedSensor>(rig.sensors[0]).jitter_fraction = jitter;
    SimulatedClock clock;
    const auto devices = make_devices(rig, clock);
    ASSERT_TRUE(devices) << devices.error().what;
    ASSERT_TRUE(devices->sensors[0]->connect());
    clock.advance(200ms);
    std::array<Sample, 400> samples{};
    ASSERT_GT(*devices->sensors[0]->read(samples, 0ns), 390u);
    Nanoseconds longest{}, last{};
    for (const auto& s : std::span(samples).first(390)) {
      if (s.channel != Channel::displacement) continue;
      if (last > 0ns) longest = std::max(longest, s.t - last);
      last = s.t;
    }
    EXPECT_EQ(longest > 1100us, jitter > 0.0) << longest.count();
  }
}

TEST(SimulatedSensor, WaitsOnTheClockForTheNextSampleOrTheTimeout) {
  Bench bench;
  ASSERT_TRUE(bench.sensor.connect());
  EXPECT_EQ(*bench.sensor.read(bench.samples, 100ms), 2u);
  EXPECT_EQ(bench.clock.now(), 1ms);
  bench.rig->at_now([](auto& rig) { rig.inject(Fault::sensor_silent); });
  EXPECT_EQ(*bench.sensor.read(bench.samples, 100ms), 0u);
  EXPECT_EQ(bench.clock.now(), 101ms);
}

TEST(SimulatedSensor, LosesNothingToASmallBufferAndCountsWhatIsLost) {
  shaker::sim::RigOptions options;
  options.dropout_fraction = 0.1;
  Bench bench(options);
  ASSERT_TRUE(bench.sensor.connect());
  bench.clock.advance(5s);
  std::size_t total = 0;
  Nanoseconds last{};
  while (const std::size_t n = *bench.sensor.read(std::span(bench.samples).first(63), 0ns)) {
    total += n;
    EXPECT_GT(bench.samples[0].t, last);
    last = bench.samples[n - 1].t;
  }
  const auto health = bench.sensor.health();
  EXPECT_EQ(total, health.samples);
  EXPECT_EQ(total / 2 + health.lost, 5000u);
  EXPECT_NEAR(static_cast<double>(health.lost), 500.0, 100.0);
}

TEST(SimulatedSensor, MarksWhatIsNotANumberAsBad) {
  Bench bench;
  ASSERT_TRUE(bench.sensor.connect());
  bench.rig->at_now([](auto& rig) { rig.inject(Fault::sensor_nan); });
  bench.clock.advance(1ms);
  ASSERT_EQ(*bench.sensor.read(bench.samples, 0ns), 2u);
  EXPECT_EQ(bench.samples[0].quality, Quality::bad);
  EXPECT_EQ(bench.samples[1].quality, Quality::good);
}

TEST(SimulatedExciter, DoesWhatIsWrittenAndReadsItBack) {
  Bench bench;
  ASSERT_TRUE(bench.exciter.write({2.0, 4.0, true, 2.0}));
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(bench.exciter.heartbeat());
    bench.clock.advance(100ms);
  }
  const auto status = bench.exciter.read();
  ASSERT_TRUE(status);
  EXPECT_TRUE(status->running && status->ready);
  EXPECT_NEAR(*status->amplitude, 2.0, 1e-9);
  EXPECT_EQ(*status->frequency_hz, 2.0);
  EXPECT_EQ(*status->heartbeat_timeout_s, 0.5);
  EXPECT_EQ(status->t, 1s);
  ASSERT_TRUE(bench.exciter.stop());
  EXPECT_FALSE(bench.exciter.read()->running);
  EXPECT_EQ(*bench.exciter.read()->amplitude, 0.0);
}

TEST(SimulatedExciter, RefusesWithASentence) {
  Bench bench;
  const auto wrong = bench.exciter.write({2.0, 400.0, true, 0.0});
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().kind, ErrorKind::refused);
  EXPECT_THAT(wrong.error().what, testing::HasSubstr("400 m/s^2"));
  EXPECT_FALSE(bench.exciter.read()->running);
}

TEST(SimulatedExciter, IsStoppedByItsOwnDeadMan) {
  Bench bench;
  ASSERT_TRUE(bench.exciter.write({2.0, 4.0, true, 0.0}));
  bench.clock.advance(600ms);
  EXPECT_FALSE(bench.exciter.read()->running);
  EXPECT_EQ(bench.exciter.read()->fault, 1u);
  const auto again = bench.exciter.write({2.0, 4.0, true, 0.0});
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().what, testing::HasSubstr("fault 1"));
  ASSERT_TRUE(bench.exciter.stop());
  EXPECT_TRUE(bench.exciter.write({2.0, 4.0, true, 0.0}));
}

TEST(SimulatedExciter, DoesNotAnswerWhenItIsSilent) {
  Bench bench;
  bench.rig->at_now([](auto& rig) { rig.inject(Fault::exciter_silent); });
  for (const auto& answer : {bench.exciter.connect(), bench.exciter.heartbeat(),
                             bench.exciter.stop(), bench.exciter.write({})}) {
    ASSERT_FALSE(answer);
    EXPECT_EQ(answer.error().kind, ErrorKind::timeout);
  }
  EXPECT_FALSE(bench.exciter.read());
}

TEST(SimulatedDevices, ServeTwoThreadsOnTheRealClock) {
  RealClock clock;
  auto rig = std::make_shared<SimulatedRig>(shaker::sim::RigOptions{}, clock);
  SimulatedExciter exciter(rig);
  SimulatedSensor sensor(rig);
  // Taken before connect(), because samples that collect while this thread waits are read at
  // once.
  const Nanoseconds begin = clock.now();
  ASSERT_TRUE(sensor.connect());
  std::thread driving([&] {
    for (int i = 0; i < 200; ++i) {
      EXPECT_TRUE(exciter.heartbeat());
      EXPECT_TRUE(exciter.read());
    }
  });
  std::array<Sample, 256> samples{};
  std::size_t total = 0;
  while (total < 40)
    total += *sensor.read(samples, 100ms);
  EXPECT_GE(clock.now() - begin, 19ms);
  driving.join();
}

}  // namespace
}  // namespace shaker::drivers::sim
