// The path of a sample must not allocate, and must cost little.
#include <chrono>

#include <gtest/gtest.h>

#include "support/counting_new.hpp"
#include "support/engine_bench.hpp"

namespace shaker::daemon {
namespace {

using testing::bench_campaign;
using testing::EngineBench;

// Ten seconds of eight channels at 10 kHz in batches of 1 ms.
class TenKilohertz {
 public:
  explicit TenKilohertz(Nanoseconds begin) : begin_(begin) {
    for (int c = 0; c < 8; ++c) {
      for (int i = 0; i < 10; ++i) {
        batch_.push_back({.channel = static_cast<protocol::Channel>(c % protocol::kChannelCount)});
      }
    }
  }
  std::span<const drivers::Sample> next() {
    for (std::size_t k = 0; k < batch_.size(); ++k) {
      const auto i = static_cast<int>(k % 10), c = static_cast<int>(k / 10);
      // The second half of the channels repeats the first a little later, as another sensor
      // would do.
      batch_[k].t = begin_ + std::chrono::microseconds(100 * (10 * turn_ + i) + 10 * (c / 4));
      batch_[k].value = 0.15 + 1e-5 * ((10 * turn_ + i) % 7);
    }
    ++turn_;
    return batch_;
  }

 private:
  Nanoseconds begin_;
  long turn_ = 0;
  std::vector<drivers::Sample> batch_;
};

TEST(EngineCost, ASampleAllocatesNothingWhileTheEngineMeasures) {
  EngineBench bench;
  ASSERT_TRUE(bench.measuring());
  std::vector<drivers::Sample> samples;
  for (int i = 0; i < 20; ++i) {  // less than a period: no cycle, no document
    samples.push_back({.t = bench.clock.now() + std::chrono::milliseconds(i + 1), .value = 0.151});
  }
  const long before = testing::allocations();
  for (const auto& s : samples)
    bench.engine.on_samples({&s, 1});
  EXPECT_EQ(testing::allocations(), before);
  EXPECT_EQ(bench.engine.state(), State::measure);
}

TEST(EngineCost, EightChannelsOfTenKilohertzTakeAFractionOfACore) {
  EngineBench bench;
  ASSERT_TRUE(bench.engine.start(bench_campaign()).ok());  // CHECK: monitors, detectors, record
  TenKilohertz input(bench.clock.now());
  const auto begin = std::chrono::steady_clock::now();
  for (int ms = 0; ms < 10'000; ++ms)
    bench.engine.on_samples(input.next());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  std::printf("10 kHz x 8 channels: %.2f %% of one core\n", 10.0 * took.count());
  EXPECT_EQ(bench.outlet.samples, 800'000u);
  EXPECT_LT(took.count(), 5.0);
}

}  // namespace
}  // namespace shaker::daemon
