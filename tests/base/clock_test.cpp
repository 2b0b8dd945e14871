#include "base/clock.hpp"

#include <gtest/gtest.h>

namespace shaker {
namespace {

using namespace std::chrono_literals;

TEST(SimulatedClock, MovesOnlyWhenToldTo) {
  SimulatedClock clock;
  EXPECT_EQ(clock.now(), 0ns);
  clock.advance(3ms);
  EXPECT_EQ(clock.now(), 3ms);
  clock.sleep_until(10ms);
  EXPECT_EQ(clock.now(), 10ms);
  clock.sleep_until(5ms);
  EXPECT_EQ(clock.now(), 10ms);
}

TEST(RealClock, IsMonotonicAndKeepsUtcApart) {
  RealClock clock;
  const auto first = clock.now();
  clock.sleep_until(first + 2ms);
  EXPECT_GE(clock.now(), first + 2ms);
  EXPECT_GT(clock.utc(), std::chrono::seconds(1'600'000'000));
}

TEST(FormatUtc, IsRfc3339WithMilliseconds) {
  EXPECT_EQ(format_utc(std::chrono::seconds(1'700'000'000) + 45ms), "2023-11-14T22:13:20.045Z");
}

}  // namespace
}  // namespace shaker
