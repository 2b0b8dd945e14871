// The CAN exciter on a real SocketCAN interface: a period of 20 ms and heartbeats of 100 ms
// make 15 frames.
// See can_wire.hpp and can_wire_main.cpp.
#include <algorithm>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "drivers/can/can_exciter.hpp"
#include "tests/drivers/can_wire.hpp"

namespace shaker::drivers::can {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr auto kData = SHAKER_TEST_DATA "/can";
const RealClock real_clock;

config::CanExciter exciter_config() {
  config::CanExciter config;
  config.interface = "vcan0";
  config.dbc = "rig.dbc";
  config.setpoint_message = "exciter_setpoint";
  config.status_message = "exciter_status";
  config.period_s = 0.02;
  return config;
}

std::unique_ptr<Exciter> connected_exciter(double heartbeat_period_s = 0.1) {
  auto made = make_can_exciter(exciter_config(), heartbeat_period_s, kData, real_clock);
  EXPECT_TRUE(made.ok());
  const auto connected = (*made)->connect();
  EXPECT_TRUE(connected.ok()) << connected.error().what;
  return std::move(*made);
}

constexpr Setpoint kMotion{2.5, 9.81, true, 2.0};

bool moving(const Seen& frame) {
  return frame.id == 0x200 && (frame.data[2] != 0 || frame.data[3] != 0) && frame.data[6] == 1;
}
bool resting(const Seen& frame) {
  return frame.id == 0x200 && frame.data[2] == 0 && frame.data[3] == 0 && frame.data[6] == 0;
}

TEST(CanExciterWire, LeavesTheExciterAsItIsWhenConnecting) {
  Peer peer("vcan0");
  auto exciter = connected_exciter();
  std::this_thread::sleep_for(100ms);
  EXPECT_TRUE(peer.take_all().empty());
  ASSERT_TRUE(exciter->heartbeat().ok()) << "nothing was commanded";
  EXPECT_TRUE(peer.take_all().empty());
}

TEST(CanExciterWire, FallsSilentWhenNobodyKeepsItAliveAndDoesNotResumeByItself) {
  Peer peer("vcan0");
  auto exciter = connected_exciter();
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(exciter->write(kMotion).ok());
    EXPECT_EQ(std::ranges::count_if(peer.take_until(15, moving), moving), 15);
    std::this_thread::sleep_for(300ms);
    EXPECT_TRUE(peer.take_all().empty()) << "silence";
    EXPECT_EQ(exciter->heartbeat().error().kind, ErrorKind::refused);
    EXPECT_THAT(exciter->write(kMotion).error().what, HasSubstr("does not resume by itself"));
    EXPECT_EQ(std::ranges::count_if(peer.take_all(), moving), 0);
    ASSERT_TRUE(exciter->write({2.5, 0.0, false, 2.0}).ok());
    EXPECT_EQ(std::ranges::count_if(peer.take_until(15, resting), resting), 15);
    std::this_thread::sleep_for(100ms);
    EXPECT_TRUE(peer.take_all().empty()) << "at rest, and silent";
  }
}

TEST(CanExciterWire, GoesOnWhileHeartbeatsComeAndCountsThem) {
  Peer peer("vcan0");
  auto exciter = connected_exciter(1.0);  // a busy machine may be late by two seconds
  ASSERT_TRUE(exciter->write(kMotion).ok());
  for (int i = 0; i < 20; ++i) {
    std::this_thread::sleep_for(50ms);
    const auto beat = exciter->heartbeat();
    ASSERT_TRUE(beat.ok()) << beat.error().what;
  }
  const auto frames = peer.take_all();
  EXPECT_GE(std::ranges::count_if(frames, moving), 40);
  ASSERT_FALSE(frames.empty());
  EXPECT_EQ(frames.back().data[7] - frames.front().data[7], 20) << "the heartbeat signal counts";
  ASSERT_TRUE(exciter->stop().ok());
}

TEST(CanExciterWire, StopsAtOnce) {
  Peer peer("vcan0");
  auto exciter = connected_exciter();
  ASSERT_TRUE(exciter->write(kMotion).ok());
  std::this_thread::sleep_for(50ms);
  peer.take_all();
  const auto asked = real_clock.now();
  ASSERT_TRUE(exciter->stop().ok());
  EXPECT_LT(real_clock.now() - asked, 2s) << "it waits for no answer";
  const auto frames = peer.take_until(15, resting);
  EXPECT_EQ(std::ranges::count_if(frames, resting), 15);
  const auto first_rest = std::ranges::find_if(frames, resting);
  EXPECT_EQ(std::count_if(first_rest, frames.end(), moving), 0);
  std::this_thread::sleep_for(100ms);
  EXPECT_TRUE(peer.take_all().empty());
  ASSERT_TRUE(exciter->heartbeat().ok());
  EXPECT_TRUE(peer.take_all().empty()) << "a heartbeat does not bring the frames back";
}

TEST(CanExciterWire, StopsThroughALinkThatWasDown) {
  TemporaryLink link("vcanwe");
  auto config = exciter_config();
  config.interface = "vcanwe";
  auto made = make_can_exciter(config, 0.1, kData, real_clock);
  ASSERT_TRUE(made.ok());
  auto& exciter = **made;
  ASSERT_TRUE(exciter.connect().ok());
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(exciter.write(kMotion).ok());
    link.down();
    std::this_thread::sleep_for(50ms);
    EXPECT_FALSE(exciter.heartbeat().ok());
    EXPECT_THAT(exciter.stop().error().what,
                HasSubstr("the stop could not be sent: vcanwe is down"));
    link.up();
    Peer peer("vcanwe");
    ASSERT_TRUE(exciter.connect().ok());
    EXPECT_FALSE(exciter.write(kMotion).ok()) << "not before it has been at rest";
    ASSERT_TRUE(exciter.stop().ok());
    const auto frames = peer.take_until(1, resting);
    EXPECT_EQ(std::ranges::count_if(frames, moving), 0);
    EXPECT_GE(std::ranges::count_if(frames, resting), 1);
  }
}

TEST(CanExciterWire, TellsAFaultThatTheNextStatusNoLongerHas) {
  Peer peer("vcan0");
  auto exciter = connected_exciter();
  peer.send(0x201, {0x03, 0x00, 0x05, 0x00, 0xC4, 0x09, 0x52, 0x26});
  peer.send(0x201, {0x03, 0x00, 0x00, 0x00, 0xC4, 0x09, 0x52, 0x26});
  const auto first = exciter->read();
  ASSERT_TRUE(first.ok()) << first.error().what;
  EXPECT_EQ(first->fault, 5u);
  EXPECT_FALSE(first->ready);
  peer.send(0x201, {0x03, 0x00, 0x00, 0x00, 0xC4, 0x09, 0x52, 0x26});
  const auto second = exciter->read();
  ASSERT_TRUE(second.ok()) << second.error().what;
  EXPECT_EQ(second->fault, 0u) << "it is told once";
}

TEST(CanExciterWire, HearsAnotherNodeCommandTheDrive) {
  Peer peer("vcan0");
  auto exciter = connected_exciter(1.0);
  const auto spoofed = [&] {
    peer.send(0x201, {0x02, 0x00, 0x00, 0x00, 0xC4, 0x09, 0x00, 0x00});
    return exciter->read();
  };
  ASSERT_TRUE(exciter->write(kMotion).ok());
  for (int i = 0; i < 5; ++i) {
    const auto own = spoofed();
    EXPECT_TRUE(own.ok()) << "our own frames: " << own.error().what;
    ASSERT_TRUE(exciter->heartbeat().ok());
  }
  peer.send(0x200, {0xC4, 0x09, 0x10, 0x27, 0xC8, 0x00, 0x01, 0x09});
  const auto told = spoofed();
  ASSERT_FALSE(told.ok());
  EXPECT_THAT(told.error().what, HasSubstr("another node sends exciter_setpoint too"));
  EXPECT_EQ(told.error().kind, ErrorKind::refused)
      << "the link is kept, so that a ramp can be sent";
  EXPECT_TRUE(exciter->heartbeat().ok());
  EXPECT_TRUE(spoofed().ok()) << "it was said";
  ASSERT_TRUE(exciter->stop().ok());
}

TEST(CanExciterWire, HearsAnotherNodeAlsoAtRestAndIgnoresItsOrdersToRest) {
  Peer peer("vcan0");
  auto exciter = connected_exciter();
  peer.send(0x200, {0, 0, 0, 0, 0, 0, 0, 0x09});
  peer.send(0x201, {0x02, 0x00, 0x00, 0x00, 0xC4, 0x09, 0x00, 0x00});
  EXPECT_TRUE(exciter->read().ok());
  peer.send(0x200, {0xC4, 0x09, 0x10, 0x27, 0xC8, 0x00, 0x01});
  EXPECT_FALSE(exciter->read().ok()) << "and a frame that is too short moves perhaps";
}

TEST(CanExciterWire, SaysThatTheControllerHasLeftTheBus) {
  Peer peer("vcan0");
  auto exciter = connected_exciter(1.0);
  ASSERT_TRUE(exciter->write(kMotion).ok());
  peer.send_raw(CAN_ERR_FLAG | CAN_ERR_BUSOFF, CAN_ERR_DLC);
  const auto off = exciter->read();
  ASSERT_FALSE(off.ok());
  EXPECT_EQ(off.error().kind, ErrorKind::unavailable);
  EXPECT_THAT(off.error().what, HasSubstr("bus-off"));
  peer.take_all();
  std::this_thread::sleep_for(100ms);
  EXPECT_EQ(std::ranges::count_if(peer.take_all(), moving), 0) << "nothing is sent any more";
  ASSERT_TRUE(exciter->connect().ok());
  EXPECT_FALSE(exciter->write(kMotion).ok()) << "not before it has been at rest";
}

// A queue that takes one frame and never passes it to the bus, as when no node acknowledges.
TEST(CanExciterWire, SaysThatItsFramesDoNotGetOntoTheBus) {
  TemporaryLink link("vcanfull");
  auto config = exciter_config();
  config.interface = "vcanfull";
  auto made = make_can_exciter(config, 1.0, kData, real_clock);
  ASSERT_TRUE(made.ok());
  auto& exciter = **made;
  ASSERT_TRUE(exciter.connect().ok());
  ASSERT_TRUE(exciter.write(kMotion).ok());
  run("tc qdisc add dev vcanfull root netem limit 1 delay 100s");
  Peer peer("vcanfull");
  ASSERT_TRUE(exciter.heartbeat().ok()) << "the kernel has taken it";
  const auto stopped = exciter.stop();
  ASSERT_FALSE(stopped.ok());
  EXPECT_THAT(stopped.error().what, HasSubstr("the stop does not get onto the bus"));
  EXPECT_EQ(stopped.error().kind, ErrorKind::exhausted) << "so that it is tried again on this link";
  run("tc qdisc del dev vcanfull root");
  ASSERT_TRUE(exciter.stop().ok());
  EXPECT_GE(std::ranges::count_if(peer.take_until(1, resting), resting), 1);
}

// A process that hangs: its frames must still end.
TEST(CanExciterWire, FallsSilentWhenItsProcessHangs) {
  Peer peer("vcan0");
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    auto exciter = connected_exciter();
    if (!exciter->write(kMotion).ok()) ::_exit(1);
    for (;;)
      ::pause();
  }
  EXPECT_EQ(std::ranges::count_if(peer.take_until(15, moving), moving), 15);
  std::this_thread::sleep_for(200ms);
  EXPECT_TRUE(peer.take_all().empty());
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
}

TEST(CanExciterWire, ReadsTheStatusAndMissesIt) {
  Peer peer("vcan0");
  auto exciter = connected_exciter();
  const auto asked = real_clock.now();
  const auto missing = exciter->read();
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().kind, ErrorKind::timeout);
  EXPECT_LT(real_clock.now() - asked, 2s);
  peer.send(0x201, {0x02, 0x00, 0x00, 0x00, 0xC4, 0x09, 0x00, 0x00});
  peer.send(0x201, {0x03, 0x00, 0x05, 0x00, 0xC4, 0x09, 0x52, 0x26});
  const auto status = exciter->read();
  ASSERT_TRUE(status.ok()) << status.error().what;
  EXPECT_TRUE(status->running);
  EXPECT_EQ(status->fault, 5u);
  EXPECT_DOUBLE_EQ(*status->amplitude, 9.81);
  peer.send(0x201, {0x02, 0x00});
  EXPECT_THAT(exciter->read().error().what, HasSubstr("2 bytes, expected 8"));
  std::this_thread::sleep_for(150ms);
  EXPECT_FALSE(exciter->read().ok()) << "the old status is not taken for the present one";
}

}  // namespace
}  // namespace shaker::drivers::can
