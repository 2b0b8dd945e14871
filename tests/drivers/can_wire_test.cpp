// The CAN sensors on a real SocketCAN interface; can_wire_main.cpp lists what that needs. The
// other node uses system calls only, no code of drivers/can (can_wire.hpp). The tests create
// and delete the links that go down or disappear.
#include "tests/drivers/can_wire.hpp"

#include <algorithm>
#include <array>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/can/error.h>

#include "drivers/can/can_sensor.hpp"
#include "drivers/can/can_socket.hpp"
#include "tests/estimator/counting_allocator.hpp"

namespace shaker::drivers::can {
namespace {

using namespace std::chrono_literals;
using protocol::Channel;
using testing::HasSubstr;

constexpr auto kData = SHAKER_TEST_DATA "/can";
const RealClock real_clock;

config::CanSensor sensor_on(const std::string& interface) {
  config::CanSensor config;
  config.interface = interface;
  config.dbc = "rig.dbc";
  config.signals = {{Channel::displacement, "transducer_tpdo1", "position", 1.0, 0.0}};
  return config;
}

std::unique_ptr<Sensor> make(const config::CanSensor& config) {
  auto made = make_can_sensor(config, kData, real_clock);
  EXPECT_TRUE(made.ok()) << made.error().what;
  return std::move(*made);
}

// Reads until a sample or an Error comes, for at most one second.
Result<std::size_t> read_some(Sensor& sensor, std::span<Sample> out) {
  return sensor.read(out, 1s);
}

TEST(CanWire, StampsSamplesWithTheirArrivalNotWithTheirReading) {
  auto sensor = make(sensor_on("vcan0"));
  ASSERT_TRUE(sensor->connect().ok());
  Peer peer("vcan0");
  std::array<Sample, 8> out;
  for (int round = 0; round < 3; ++round) {
    const auto before = real_clock.now();
    peer.send(0x181, {0x40, 0xE2, 0x01, 0x00, 0, 0});
    const auto after = real_clock.now();
    std::this_thread::sleep_for(200ms);
    const auto count = read_some(*sensor, out);
    ASSERT_TRUE(count.ok());
    ASSERT_EQ(*count, 1u);
    EXPECT_DOUBLE_EQ(out[0].value, 123456e-9);
    EXPECT_GE(out[0].t, before - 1ms);
    EXPECT_LE(out[0].t, after + 100ms) << "stamped when it was read";
  }
  EXPECT_EQ(sensor->stamp_source(), StampSource::kernel_receive);
  EXPECT_EQ(sensor->health().samples, 3u);
}

TEST(CanWire, LetsTheKernelFilterWhatIsNotWanted) {
  CanSocket::Options options;
  options.interface = "vcan0";
  options.identifiers = {{0x181, false}, {0x18FEF1FE, true}};
  auto socket = CanSocket::open(options);
  ASSERT_TRUE(socket.ok()) << socket.error().what;
  Peer peer("vcan0");
  peer.send(0x180, {1});
  peer.send(0x181 | CAN_EFF_FLAG, {2});
  peer.send(0x181 | CAN_RTR_FLAG, {});
  peer.send(0x181, {3});
  peer.send(0x18FEF1FE | CAN_EFF_FLAG, {4});
  std::array<Received, 8> got;
  const auto count = socket->receive(got, 1s);
  ASSERT_TRUE(count.ok());
  ASSERT_EQ(*count, 2u);
  EXPECT_EQ(got[0].frame.data[0], 3);
  EXPECT_EQ(got[1].frame.data[0], 4);
  EXPECT_TRUE(got[1].frame.extended);
  EXPECT_GT(got[0].utc, 1'600'000'000s);
}

TEST(CanWire, CountsEveryFrameThatTheFullQueueDropped) {
  CanSocket::Options options;
  options.interface = "vcan0";
  options.identifiers = {{0x181, false}};
  options.receive_buffer = 16 << 10;
  auto socket = CanSocket::open(options);
  ASSERT_TRUE(socket.ok());
  Peer peer("vcan0");
  for (int i = 0; i < 1000; ++i)
    peer.send(0x181, {0, 0, 0, 0, 0, 0});
  std::array<Received, CanSocket::kBatch> got;
  std::uint64_t received = 0;
  const auto drain = [&] {
    for (;;) {
      const auto count = socket->receive(got, 50ms);
      ASSERT_TRUE(count.ok());
      if (*count == 0) return;
      received += *count;
    }
  };
  drain();
  EXPECT_LT(received, 1000u);
  peer.send(0x181, {0, 0, 0, 0, 0, 0});  // the next received frame reports the counter
  drain();
  EXPECT_EQ(received + socket->dropped(), 1001u);
}

TEST(CanWire, SaysThatTheSensorIsSilent) {
  auto sensor = make(sensor_on("vcan0"));
  ASSERT_TRUE(sensor->connect().ok());
  std::array<Sample, 8> out;
  EXPECT_EQ(*sensor->read(out, 150ms), 0u);
  EXPECT_THAT(sensor->health().trouble,
              HasSubstr("silent for 0.1 s, its messages are due every 1 ms"));
  EXPECT_TRUE(sensor->health().link_up) << "the link itself is well";
}

TEST(CanWire, HoldsTenThousandFramesWhileNobodyReads) {
  auto sensor = make(sensor_on("vcan0"));
  ASSERT_TRUE(sensor->connect().ok());
  EXPECT_EQ(sensor->health().trouble, "");
  Peer peer("vcan0");
  for (int i = 0; i < 10'000; ++i)
    peer.send(0x181, {0, 0, 0, 0, 0, 0});
  std::array<Sample, 200> out;
  while (sensor->health().samples < 10'000) {
    const auto count = sensor->read(out, 200ms);
    ASSERT_TRUE(count.ok());
    if (*count == 0) break;
  }
  EXPECT_EQ(sensor->health().samples, 10'000u);
  EXPECT_EQ(sensor->health().lost, 0u);
}

TEST(CanWire, ReadsWithoutAllocating) {
  auto sensor = make(sensor_on("vcan0"));
  ASSERT_TRUE(sensor->connect().ok());
  Peer peer("vcan0");
  std::array<Sample, 64> out;
  std::size_t samples = 0;
  const long before = estimator::testing::allocation_count();
  for (int i = 0; i < 200; ++i) {
    peer.send_raw(0x181, 6);
    if (i % 50 == 0) peer.send_raw(CAN_ERR_FLAG | CAN_ERR_CRTL, 8);
    const auto count = sensor->read(out, 1s);
    if (count.ok()) samples += *count;
  }
  EXPECT_EQ(estimator::testing::allocation_count() - before, 0);
  EXPECT_GE(samples, 196u);
}

TEST(CanWire, RecoversWhenTheLinkGoesDownAndUpTwice) {
  TemporaryLink link("vcanwa");
  auto sensor = make(sensor_on("vcanwa"));
  ASSERT_TRUE(sensor->connect().ok());
  std::array<Sample, 8> out;
  for (unsigned round = 1; round <= 2; ++round) {
    link.down();
    const auto lost = read_some(*sensor, out);
    ASSERT_FALSE(lost.ok());
    EXPECT_THAT(lost.error().what, HasSubstr("vcanwa is down: set it up with"));
    EXPECT_FALSE(sensor->health().link_up);
    EXPECT_THAT(sensor->connect().error().what, HasSubstr("is down")) << "still down";
    link.up();
    ASSERT_TRUE(sensor->connect().ok());
    EXPECT_TRUE(sensor->health().link_up);
    EXPECT_EQ(sensor->health().trouble, "");
    EXPECT_EQ(sensor->health().reconnects, round);
    Peer("vcanwa").send(0x181, {0, 0, 0, 0, 0, 0});
    const auto count = read_some(*sensor, out);
    ASSERT_TRUE(count.ok()) << count.error().what;
    EXPECT_EQ(*count, 1u);
  }
}

TEST(CanWire, OpensAgainByNameWhenTheAdapterWasPulledTwice) {
  TemporaryLink link("vcanwb");
  auto sensor = make(sensor_on("vcanwb"));
  ASSERT_TRUE(sensor->connect().ok());
  std::array<Sample, 8> out;
  for (unsigned round = 1; round <= 2; ++round) {
    link.remove();
    const auto lost = read_some(*sensor, out);
    ASSERT_FALSE(lost.ok());
    EXPECT_EQ(lost.error().kind, ErrorKind::unavailable);
    EXPECT_THAT(sensor->connect().error().what, HasSubstr("there is no interface vcanwb"));
    link.add();
    ASSERT_TRUE(sensor->connect().ok());
    Peer("vcanwb").send(0x181, {0, 0, 0, 0, 0, 0});
    const auto count = read_some(*sensor, out);
    ASSERT_TRUE(count.ok()) << count.error().what;
    EXPECT_EQ(*count, 1u);
    EXPECT_EQ(sensor->health().reconnects, round);
  }
}

// The kernel reports ENODEV to the first reader only. Here another reader got it, because a
// second interface took the name before the sensor looked.
TEST(CanWire, NoticesThatAnotherInterfaceTookTheName) {
  TemporaryLink link("vcanwc");
  auto socket = CanSocket::open({"vcanwc", {{0x181, false}}, false, true, 1 << 16});
  ASSERT_TRUE(socket.ok());
  EXPECT_TRUE(socket->still_there());
  link.remove();
  link.add();
  EXPECT_FALSE(socket->still_there());
}

TEST(CanWire, ReceivesFdFrames) {
  auto config = sensor_on("vcan0");
  config.fd = true;
  config.signals = {{Channel::displacement, "wide", "last", 1.0, 0.0}};
  auto sensor = make(config);
  const auto connected = sensor->connect();
  ASSERT_TRUE(connected.ok()) << connected.error().what;
  std::vector<std::uint8_t> data(64, 0);
  data[60] = data[61] = data[62] = 0xFF, data[63] = 0xFE;
  Peer peer("vcan0");
  peer.send_fd(300, data);
  peer.send(300, {1, 2, 3, 4, 5, 6, 7, 8});  // a classic frame with that identifier is too short
  std::array<Sample, 8> out;
  const auto count = read_some(*sensor, out);
  ASSERT_TRUE(count.ok());
  ASSERT_EQ(*count, 1u);
  EXPECT_DOUBLE_EQ(out[0].value, -2e-6);
  EXPECT_EQ(sensor->health().malformed, 1u);
}

TEST(CanWire, SaysThatALinkIsNotSetUpForFd) {
  TemporaryLink link("vcanwd");
  link.down();
  run("ip link set vcanwd mtu 16");
  link.up();
  auto config = sensor_on("vcanwd");
  config.fd = true;
  EXPECT_THAT(make(config)->connect().error().what, HasSubstr("vcanwd is not set up for CAN FD"));
}

TEST(CanWire, SaysThatAnInterfaceIsNoCanInterface) {
  const auto refused = make(sensor_on("lo"))->connect();
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().what, HasSubstr("no CAN interface"));
}

TEST(CanWire, ReportsErrorFramesAndRecoversFromBusOffTwice) {
  auto sensor = make(sensor_on("vcan0"));
  ASSERT_TRUE(sensor->connect().ok());
  Peer peer("vcan0");
  std::array<Sample, 8> out;
  for (unsigned round = 1; round <= 2; ++round) {
    peer.send(CAN_ERR_FLAG | CAN_ERR_BUSOFF, {0, 0, 0, 0, 0, 0, 0, 0});
    ASSERT_TRUE(sensor->read(out, 50ms).ok());
    EXPECT_FALSE(sensor->health().link_up);
    EXPECT_THAT(sensor->health().trouble, HasSubstr("vcan0: the controller is bus-off"));
    peer.send(CAN_ERR_FLAG | CAN_ERR_RESTARTED, {0, 0, 0, 0, 0, 0, 0, 0});
    ASSERT_TRUE(sensor->read(out, 50ms).ok());
    EXPECT_TRUE(sensor->health().link_up);
    EXPECT_GE(sensor->health().errors, 2 * round);
  }
}

TEST(CanWire, StartsACanopenNodeAndSendsSync) {
  auto config = sensor_on("vcan0");
  config.canopen = config::CanOpen{1, true, 0.02};
  auto sensor = make(config);
  Peer peer("vcan0");
  ASSERT_TRUE(sensor->connect().ok());
  std::array<Sample, 8> out;
  ASSERT_TRUE(sensor->read(out, 410ms).ok());
  auto seen = peer.take_all();
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen.front().id, 0u);
  EXPECT_THAT(seen.front().data, testing::ElementsAre(1, 1));
  const auto syncs = std::ranges::count(seen, 0x80u, &Seen::id);
  EXPECT_GE(syncs, 5);
  EXPECT_LE(syncs, 22);

  peer.send(0x181, {0, 0, 0, 0, 0, 0});
  peer.send(0x181, {0, 0, 0, 0, 0, 0});
  peer.send(0x701, {0});
  const auto count = sensor->read(out, 30ms);
  ASSERT_TRUE(count.ok());
  EXPECT_EQ(*count, 0u) << "the block of before the boot-up is discarded";
  EXPECT_EQ(sensor->health().lost, 2u);
  EXPECT_THAT(sensor->health().trouble, HasSubstr("lost power"));
  EXPECT_EQ(std::ranges::count(peer.take_all(), 0u, &Seen::id), 1) << "started again";
}

}  // namespace
}  // namespace shaker::drivers::can
