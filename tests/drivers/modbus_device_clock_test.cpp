// The device's stamps against polls of known latency, which the test generates.
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/modbus/device_clock.hpp"

namespace shaker::drivers::modbus {
namespace {

using namespace std::chrono_literals;

// Polled every 4 ms. An answer holds a sample that is at least 30 us old and mostly 0.1 ms
// older; one answer in twenty comes 5 ms later still.
class Poller {
 public:
  Poller(DeviceClock::Counter counter, double ppm, double device_start_s = 1000.0)
      : clock(counter), counter_(counter), rate_(1.0 + ppm * 1e-6), start_(device_start_s) {}

  DeviceClock clock;
  std::vector<double> error;    // stamp - true time, s
  std::vector<double> latency;  // receipt - true time, s

  void run(double duration_s) {
    for (const double end = true_ + duration_s; true_ < end; true_ += 0.004)
      poll();
  }
  // The PC is busy: during each second, every answer is late by the same amount.
  void run_busy(double duration_s) {
    std::exponential_distribution<double> floor(1.0 / 300e-6);
    for (double second = 0.0; second < duration_s; second += 1.0) {
      busy_ = floor(random_);
      run(1.0);
    }
    busy_ = 0.0;
  }
  void pause(double duration_s) { true_ += duration_s; }
  void set_device_clock(double s) { start_ = s - rate_ * true_; }
  void forget() {
    error.clear();
    latency.clear();
  }

 private:
  std::uint32_t raw() const {
    const double ticks = std::floor((start_ + rate_ * true_) * 1e9 / counter_.tick_ns);
    return static_cast<std::uint32_t>(std::fmod(ticks, std::ldexp(1.0, counter_.bits)));
  }
  void poll() {
    double late = 30e-6 + busy_ + quick_(random_);
    if (slow_(random_)) late += 5e-3 * share_(random_);
    const double took = true_ + late;
    const auto received = std::max(received_ + 1us, from_seconds(5000.0 + took));
    const auto stamp = clock.stamp(raw(), received - from_seconds(late), received);
    ASSERT_TRUE(stamp);
    EXPECT_GT(*stamp, newest_);
    EXPECT_LE(*stamp, received);
    newest_ = *stamp;
    received_ = received;
    error.push_back(seconds(*stamp) - 5000.0 - true_);
    latency.push_back(seconds(received) - 5000.0 - true_);
  }

  const DeviceClock::Counter counter_;
  const double rate_;
  double start_, true_ = 0.0, busy_ = 0.0;
  Nanoseconds newest_{}, received_{};
  std::mt19937 random_{20260301};
  std::exponential_distribution<double> quick_{1e4};
  std::bernoulli_distribution slow_{0.05};
  std::uniform_real_distribution<double> share_{0.0, 1.0};
};

double scatter(const std::vector<double>& values) {
  double mean = 0.0, squares = 0.0;
  for (const double v : values)
    mean += v / static_cast<double>(values.size());
  for (const double v : values)
    squares += (v - mean) * (v - mean);
  return std::sqrt(squares / static_cast<double>(values.size()));
}

constexpr DeviceClock::Counter kMicroseconds{32, 1e3};
constexpr DeviceClock::Counter kMilliseconds{16, 1e6};

TEST(DeviceClock, TakesThePollingJitterOutOfTheStamps) {
  Poller poller(kMicroseconds, 0.0);
  poller.run(5.0);
  poller.forget();
  poller.run(30.0);
  EXPECT_GT(scatter(poller.latency), 5e-4);
  EXPECT_LT(scatter(poller.error), 3e-6);
  EXPECT_NEAR(poller.error.back(), 30e-6, 10e-6);
}

TEST(DeviceClock, IsBetterThanThePollsFromTheFirstSecond) {
  Poller poller(kMicroseconds, 50.0);
  poller.run(0.1);
  poller.forget();
  poller.run(3.0);
  EXPECT_LT(scatter(poller.error), 0.1 * scatter(poller.latency));
}

TEST(DeviceClock, FollowsAClockOfAnotherRate) {
  for (const double ppm : {-1000.0, -20.0, 20.0, 1000.0}) {
    Poller poller(kMicroseconds, ppm);
    poller.run(15.0);
    poller.forget();
    poller.run(60.0);
    EXPECT_LT(scatter(poller.error), 5e-6) << ppm;
    EXPECT_NEAR(poller.error.back(), 30e-6, 20e-6) << ppm;
    EXPECT_EQ(poller.clock.beginnings(), 1u) << ppm;
  }
}

// The rate is known after three seconds; what the error has grown to until then is gone five later.
TEST(DeviceClock, HasCorrectedAnotherRateAfterEightSeconds) {
  for (const double ppm : {-200.0, 200.0}) {
    Poller poller(kMicroseconds, ppm);
    poller.run(8.0);
    EXPECT_NEAR(poller.error.back(), 30e-6, 20e-6) << ppm;
  }
}

// The phase of a cycle depends on the rate of the error: 4e-5 with an envelope of ten seconds.
TEST(DeviceClock, HoldsItsRateOnABusyPc) {
  for (const double ppm : {0.0, 50.0}) {
    Poller poller(kMicroseconds, ppm);
    poller.run_busy(30.0);
    poller.forget();
    poller.run_busy(120.0);
    std::vector<double> rate;  // over half a second
    for (std::size_t i = 125; i < poller.error.size(); i += 125)
      rate.push_back((poller.error[i] - poller.error[i - 125]) / 0.5);
    EXPECT_LT(scatter(rate), 8e-6) << ppm;
    EXPECT_LT(scatter(poller.error), 3e-5) << ppm;
  }
}

TEST(DeviceClock, GoesOnOverAWrap) {
  Poller poller(kMicroseconds, 20.0, 4294.967296 - 20.0);
  poller.run(15.0);
  poller.forget();
  poller.run(30.0);
  EXPECT_LT(scatter(poller.error), 5e-6);
  EXPECT_EQ(poller.clock.beginnings(), 1u);
}

TEST(DeviceClock, CountsTheWrapsOfAPause) {
  Poller poller(kMilliseconds, 0.0);
  poller.run(20.0);
  poller.pause(200.0);  // three wraps of 65.5 s
  poller.forget();
  poller.run(5.0);
  EXPECT_EQ(poller.clock.beginnings(), 1u);
  EXPECT_LT(scatter(poller.error), 0.3e-3) << "a millisecond's own steps are 0.29";
}

// 1000 ppm are 0.1 s in 100 s: a clock with another rate has not jumped.
TEST(DeviceClock, GoesOnAfterAPauseAtAnotherRate) {
  Poller poller(kMicroseconds, 1000.0);
  poller.run(15.0);
  poller.pause(100.0);
  poller.run(1.0);
  EXPECT_EQ(poller.clock.beginnings(), 1u);
}

TEST(DeviceClock, BeginsAnewWhenTheClockLostTimeInAPause) {
  Poller poller(kMicroseconds, 0.0);
  poller.run(15.0);
  poller.pause(1.0);
  poller.set_device_clock(1015.7);  // without a jump: 1016
  poller.run(1.0);
  EXPECT_EQ(poller.clock.beginnings(), 2u);
}

TEST(DeviceClock, BeginsAnewWhenTheDevicesClockJumps) {
  for (const double to : {0.0, 999.0, 1015.1, 1016.0, 3000.0}) {  // without a jump: 1015
    Poller poller(kMicroseconds, 0.0);
    poller.run(15.0);
    poller.set_device_clock(to);
    poller.run(1.0);
    EXPECT_GT(poller.clock.beginnings(), 1u) << to;
    poller.forget();
    poller.run(10.0);
    EXPECT_LT(scatter(poller.error), 20e-6) << to;
    EXPECT_NEAR(poller.error.back(), 30e-6, 20e-6) << to;
  }
}

TEST(DeviceClock, BeginsAnewAfterAReconnect) {
  DeviceClock clock(kMicroseconds);
  EXPECT_EQ(clock.stamp(1000, 10ms, 11ms), 11ms);
  EXPECT_EQ(clock.stamp(5000, 14ms, 15ms), 15ms);
  clock.restart();
  EXPECT_EQ(clock.stamp(8000, 18ms, 20ms), 20ms) << "not 18 ms: nothing of before counts";
  EXPECT_EQ(clock.beginnings(), 2u);
}

TEST(DeviceClock, GivesASampleOnce) {
  DeviceClock clock(kMicroseconds);
  EXPECT_TRUE(clock.stamp(1000, 10ms, 11ms));
  EXPECT_FALSE(clock.stamp(1000, 14ms, 15ms));
  EXPECT_EQ(clock.stamp(9000, 18ms, 19ms), 19ms);
  EXPECT_FALSE(clock.stamp(9000, 22ms, 23ms));
  clock.restart();
  EXPECT_FALSE(clock.stamp(9000, 26ms, 27ms)) << "nor by way of a new connection";
}

// What a lost link was like says nothing about the next one.
TEST(DeviceClock, ForgetsEverythingAtARestart) {
  const auto poll = [](DeviceClock& clock, int k, double device_rate) {
    const Nanoseconds received = 4ms * k + 10us * (k * k % 7);
    return clock.stamp(static_cast<std::uint32_t>(4000.0 * device_rate * k), received - 1ms,
                       received);
  };
  DeviceClock used({}), fresh({});
  for (int k = 1; k < 5000; ++k)
    ASSERT_TRUE(poll(used, k, 1.0002));  // its offset falls
  used.restart();
  for (int k = 5000; k < 10000; ++k)
    ASSERT_EQ(poll(used, k, 1.0), poll(fresh, k, 1.0)) << k;
  EXPECT_EQ(used.beginnings(), 2u);
}

}  // namespace
}  // namespace shaker::drivers::modbus
