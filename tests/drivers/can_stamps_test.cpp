#include <gtest/gtest.h>

#include "drivers/can/stamps.hpp"

namespace shaker::drivers::can {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kEpoch = std::chrono::seconds(1'700'000'000);

// A converter at monotonic time 100 s, with the wall clock `kEpoch` ahead.
StampConverter started() {
  StampConverter converter;
  converter.restart({100s, kEpoch + 100s});
  return converter;
}

TEST(Stamps, FollowTheDifferenceOfTheClocks) {
  auto converter = started();
  converter.update({100s + 5ms, kEpoch + 100s + 5ms});
  EXPECT_EQ(converter.convert(kEpoch + 100s + 1ms), 100s + 1ms);
  EXPECT_EQ(converter.convert(kEpoch + 100s + 2ms), 100s + 2ms);
  EXPECT_EQ(converter.replaced(), 0u);
}

TEST(Stamps, SurviveAStepOfTheWallClockBetweenArrivalAndReading) {
  for (const Nanoseconds step :
       {Nanoseconds(-3600s), Nanoseconds(-20ms), Nanoseconds(20ms), Nanoseconds(3600s)}) {
    auto converter = started();
    converter.update({100s + 5ms, kEpoch + 100s + 5ms});
    EXPECT_EQ(converter.convert(kEpoch + 100s + 4ms), 100s + 4ms);
    converter.update({100s + 10ms, kEpoch + 100s + 10ms + step});
    EXPECT_EQ(converter.convert(kEpoch + 100s + 8ms), 100s + 8ms) << "stamped before the step";
    EXPECT_EQ(converter.convert(kEpoch + 100s + 9ms + step), 100s + 9ms) << "stamped after it";
    EXPECT_EQ(converter.replaced(), 0u);
  }
}

TEST(Stamps, FallBackToTheTimeOfReadingAndCountIt) {
  auto converter = started();
  converter.update({100s + 5ms, kEpoch + 100s + 5ms});
  EXPECT_EQ(converter.convert(0ns), 100s + 5ms) << "no stamp";
  converter.update({100s + 9ms, kEpoch + 100s + 9ms});
  EXPECT_EQ(converter.convert(kEpoch + 101s), 100s + 9ms) << "from the future";
  EXPECT_EQ(converter.convert(kEpoch + 1s), 100s + 9ms) << "from the past";
  EXPECT_EQ(converter.replaced(), 3u);
}

TEST(Stamps, NeverRunBackwardsNorAhead) {
  auto converter = started();
  converter.update({100s + 5ms, kEpoch + 100s + 5ms});
  EXPECT_EQ(converter.convert(kEpoch + 100s + 3ms), 100s + 3ms);
  EXPECT_EQ(converter.convert(kEpoch + 100s + 3ms - 200us), 100s + 3ms);
  EXPECT_EQ(converter.convert(kEpoch + 100s + 5ms + 200us), 100s + 5ms);
}

// The first two readings of this clock take longer, as after a preemption.
class SlowClock final : public Clock {
 public:
  Nanoseconds now() const override {
    ++calls_;
    return now_ += calls_ <= 4 ? 500us : 100ns;
  }
  Nanoseconds utc() const override { return kEpoch + now_; }
  void sleep_until(Nanoseconds) override {}

 private:
  mutable Nanoseconds now_{};
  mutable int calls_ = 0;
};

TEST(Stamps, TakeTheTightestPairOfClockReadings) {
  const SlowClock clock;
  const ClockPair pair = read_pair(clock);
  EXPECT_LE(std::chrono::abs(pair.utc - kEpoch - pair.monotonic), 100ns);
  EXPECT_GT(pair.monotonic, 2ms) << "the two slow tries come first";
}

TEST(Stamps, AgreeWithTheRealClocks) {
  const RealClock clock;
  StampConverter converter;
  converter.restart(read_pair(clock));
  const auto before = clock.now();
  const auto stamp = clock.utc();
  const auto after = clock.now();
  converter.update(read_pair(clock));
  const auto t = converter.convert(stamp);
  EXPECT_GE(t, before - 100us);
  EXPECT_LE(t, after + 100us);
}

}  // namespace
}  // namespace shaker::drivers::can
