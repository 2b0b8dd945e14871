#include <gtest/gtest.h>

#include "drivers/can/bus_watch.hpp"

namespace shaker::drivers::can {
namespace {

using namespace std::chrono_literals;
using protocol::can::Frame;

// SETPOINT of two bytes every 20 ms, STATUS every 20 ms.
struct CanBusWatch : testing::Test {
  BusWatch watch{20ms, 0.02};
};

Frame frame(std::uint8_t amplitude, std::uint8_t count) {
  Frame made;
  made.id = 0x200;
  made.length = 2;
  made.data[0] = amplitude;
  made.data[1] = count;
  return made;
}

TEST_F(CanBusWatch, KnowsItsOwnFrames) {
  EXPECT_FALSE(watch.is_ours(frame(3, 1), 1s)) << "nothing was sent";
  watch.sending(frame(3, 1), 1s);
  EXPECT_FALSE(watch.heard());
  EXPECT_TRUE(watch.is_ours(frame(3, 1), 1s));
  EXPECT_TRUE(watch.heard());
  EXPECT_FALSE(watch.is_ours(frame(5, 1), 1s)) << "another amplitude";
  auto cut = frame(3, 1);
  cut.length = 1;
  EXPECT_FALSE(watch.is_ours(cut, 1s)) << "another length";
}

TEST_F(CanBusWatch, AnOldFrameIsOursForASecond) {
  watch.sending(frame(3, 1), 1s);
  watch.sending(frame(3, 2), 2s);
  EXPECT_TRUE(watch.is_ours(frame(3, 1), 3s)) << "it may have waited for the bus";
  EXPECT_FALSE(watch.heard()) << "the present one has not come back";
  EXPECT_FALSE(watch.is_ours(frame(3, 1), 3s + 1ns));
  EXPECT_TRUE(watch.is_ours(frame(3, 2), 60s)) << "the kernel still sends it";
  watch.silent(61s);
  EXPECT_TRUE(watch.is_ours(frame(3, 2), 62s));
  EXPECT_FALSE(watch.is_ours(frame(3, 2), 63s)) << "somebody repeats it after we fell silent";
}

TEST_F(CanBusWatch, RemembersASecondOfChangesOfTheSetpoint) {
  for (std::uint8_t i = 0; i < 200; ++i)
    watch.sending(frame(3, i), 1s + i * 20ms);
  EXPECT_TRUE(watch.is_ours(frame(3, 160), 1s + 199 * 20ms));
  EXPECT_FALSE(watch.is_ours(frame(3, 130), 1s + 199 * 20ms));
}

TEST_F(CanBusWatch, SeesThatNothingGetsOntoTheBus) {
  EXPECT_FALSE(watch.unheard(1s)) << "nothing is sent";
  watch.sending(frame(3, 1), 1s);
  EXPECT_TRUE(watch.is_ours(frame(3, 1), 1s));
  EXPECT_FALSE(watch.unheard(1100ms));
  EXPECT_FALSE(watch.unheard(1200ms));
  EXPECT_FALSE(watch.unheard(1200ms)) << "0.2 s are allowed";
  EXPECT_TRUE(watch.unheard(1201ms));
  EXPECT_TRUE(watch.is_ours(frame(3, 1), 1202ms));
  for (int look = 0; look < 5; ++look)
    EXPECT_FALSE(watch.unheard(1300ms)) << "it is back since 98 ms";
  watch.silent(1301ms);
  EXPECT_FALSE(watch.unheard(5s)) << "silence is what was asked for";
}

TEST_F(CanBusWatch, DoesNotBlameTheBusForAPauseOfTheMachine) {
  watch.sending(frame(3, 1), 1s);
  EXPECT_TRUE(watch.is_ours(frame(3, 1), 1s));
  EXPECT_FALSE(watch.unheard(9s)) << "the first look after it";
  EXPECT_FALSE(watch.unheard(9s)) << "the second";
  EXPECT_TRUE(watch.unheard(9100ms));
}

TEST_F(CanBusWatch, CountsASlowPeriodFiveTimes) {
  BusWatch slow{100ms, std::nullopt};
  slow.sending(frame(3, 1), 1s);
  for (int i = 0; i < 5; ++i)
    EXPECT_FALSE(slow.unheard(1500ms));
  EXPECT_TRUE(slow.unheard(1501ms));
}

void statuses(BusWatch& watch, Nanoseconds from, Nanoseconds until, Nanoseconds period) {
  for (Nanoseconds t = from; t < until; t += period)
    watch.on_status(t);
}

TEST_F(CanBusWatch, SeesThatTwoNodesSendTheStatus) {
  statuses(watch, 10s, 20s, 20ms);
  EXPECT_FALSE(watch.two_senders()) << "as stated";
  statuses(watch, 20s, 21s, 10ms);
  EXPECT_FALSE(watch.two_senders()) << "not yet";
  statuses(watch, 21s, 22s, 10ms);
  EXPECT_TRUE(watch.two_senders());
  statuses(watch, 22s, 24s, 20ms);
  EXPECT_FALSE(watch.two_senders()) << "the other one has gone";
}

TEST_F(CanBusWatch, TakesABurstAfterAPauseForNoSecondSender) {
  for (Nanoseconds t = 10s; t < 60s; t += 2s)
    statuses(watch, t, t + 200ms, 2ms);
  EXPECT_FALSE(watch.two_senders());
}

TEST(CanBusWatchUnstated, AStatusWithoutAStatedPeriodMayComeAsOftenAsItLikes) {
  BusWatch watch{20ms, std::nullopt};
  statuses(watch, 10s, 20s, 1ms);
  EXPECT_FALSE(watch.two_senders());
}

}  // namespace
}  // namespace shaker::drivers::can
