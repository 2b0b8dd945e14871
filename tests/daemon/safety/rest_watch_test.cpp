#include "daemon/safety/rest_watch.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;

// So many milliseconds of samples at 1 kHz after `t`; the sign changes every 50 ms.
Nanoseconds feed(RestWatch& watch, Nanoseconds t, int milliseconds, double amplitude) {
  for (int i = 0; i < milliseconds; ++i)
    watch.add(t += 1ms, i / 50 % 2 == 0 ? amplitude : -amplitude);
  return t;
}

TEST(RestWatch, SeesMotionAndRest) {
  RestWatch watch;
  watch.learn(0.01);
  Nanoseconds t = feed(watch, 0ns, 1000, 0.005);
  EXPECT_FALSE(watch.moves());
  t = feed(watch, t, 1000, 1.0);
  EXPECT_TRUE(watch.moves());
  EXPECT_NEAR(watch.level(), 1.0, 0.05);
  feed(watch, t, 1000, 0.005);
  EXPECT_FALSE(watch.moves());
}

// Five times the noise, whatever the frequency: averages over 10 ms would hide 100 Hz.
TEST(RestWatch, SeesFastMotion) {
  for (const double hz : {1.0, 20.0, 100.0, 230.0}) {
    RestWatch watch;
    watch.learn(0.01);
    bool seen = false;
    for (int i = 0; i < 1000; ++i) {
      watch.add(i * 1ms, 9.81 + 0.1 * std::sin(2.0 * std::numbers::pi * hz * 1e-3 * i));
      seen = seen || watch.moves();
    }
    EXPECT_TRUE(seen) << hz;
  }
}

// What came before a gap counts no more, wherever the window stood.
TEST(RestWatch, BeginsAnewAfterAGap) {
  RestWatch watch;
  watch.learn(0.01);
  const Nanoseconds t = feed(watch, 0ns, 600, 1.0);
  EXPECT_TRUE(watch.moves());
  feed(watch, t + 1s, 300, 0.0);
  EXPECT_FALSE(watch.moves());
  EXPECT_LT(watch.level(), 1e-9);
  EXPECT_FALSE(watch.covers_since(t));
}

}  // namespace
}  // namespace shaker::daemon
