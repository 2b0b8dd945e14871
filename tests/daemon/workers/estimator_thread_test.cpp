#include "daemon/workers/estimator_thread.hpp"

#include <cmath>
#include <numbers>

#include "tests/daemon/workers/eventually.hpp"

namespace shaker::daemon {
namespace {

using testing::eventually;

// A linear oscillator, whose steady state is known: u'' + d u' + k u = x with x = A cos(wt).
constexpr double kDamping = 8.0, kStiffness = 400.0;

config::ModelSpec oscillator(const char* stiffness_effect = "linear_stiffness") {
  config::ModelSpec model;
  model.name = "oscillator";
  config::EffectSpec damping, stiffness;
  damping.effect = "viscous_damping";
  stiffness.effect = stiffness_effect;
  model.effects = {damping, stiffness};
  return model;
}

estimator::MeasuredCycle cycle(long index) {
  constexpr int kPoints = 64;
  constexpr double kFrequency = 2.0, kAmplitude = 3.0, kTurn = 2.0 * std::numbers::pi;
  const double w = kTurn * kFrequency;
  const double gain = kAmplitude / std::hypot(kStiffness - w * w, kDamping * w);
  const double lag = std::atan2(kDamping * w, kStiffness - w * w);
  estimator::MeasuredCycle measured;
  measured.run = 0;
  measured.index = index;
  measured.frequency_hz = kFrequency;
  measured.amplitude = kAmplitude;
  for (int i = 0; i < kPoints; ++i) {
    measured.displacement.push_back(gain * std::cos(kTurn * i / kPoints - lag));
  }
  return measured;
}

class EstimatorThreadTest : public ::testing::Test {
 protected:
  RealClock clock;
  Waker waker;
  EstimatorThread thread{clock, waker};
  std::vector<EstimateOutcome> outcomes;
  bool have(std::size_t count) {
    return eventually([&] {
      for (auto& outcome : thread.take())
        outcomes.push_back(std::move(outcome));
      return outcomes.size() >= count;
    });
  }
};

TEST_F(EstimatorThreadTest, GivesExactlyOneOutcomeForEachCycle) {
  thread.begin(oscillator(), {});
  for (long i = 0; i < 5; ++i) {
    thread.add(cycle(i), Nanoseconds(100 + i));
    ASSERT_TRUE(have(static_cast<std::size_t>(i) + 1));
  }
  for (long i = 0; i < 5; ++i) {
    const auto& outcome = outcomes[static_cast<std::size_t>(i)];
    EXPECT_EQ(outcome.cycle, i);
    EXPECT_EQ(outcome.last_sample, Nanoseconds(100 + i));
    EXPECT_EQ(outcome.cycles_skipped, 0);
    ASSERT_TRUE(outcome.estimate) << outcome.estimate.error().what;
    EXPECT_EQ(outcome.estimate->cycles, i + 1);
  }
  EXPECT_FALSE(thread.busy_since());
}

TEST_F(EstimatorThreadTest, IsBusyFromWhenItIsGivenACycle) {
  thread.begin(oscillator(), {});
  const Nanoseconds before = clock.now();
  thread.add(cycle(0), {});
  // A thread that never starts to work on the cycle must be visible too.
  const auto since = thread.busy_since();
  EXPECT_GE(since.value_or(before), before);
  EXPECT_TRUE(since || !thread.take().empty());
  EXPECT_TRUE(eventually([&] { return !thread.busy_since(); }));
}

TEST_F(EstimatorThreadTest, SkipsToTheNewestCycleAndCounts) {
  thread.begin(oscillator(), {});
  for (long i = 0; i < 1000; ++i)
    thread.add(cycle(i), Nanoseconds(i));
  ASSERT_TRUE(eventually([&] {
    for (auto& outcome : thread.take())
      outcomes.push_back(std::move(outcome));
    return !outcomes.empty() && outcomes.back().cycle == 999;
  }));
  EXPECT_EQ(outcomes.back().cycles_skipped + static_cast<long>(outcomes.size()), 1000);
  EXPECT_GT(outcomes.back().cycles_skipped, 0);
}

TEST_F(EstimatorThreadTest, SaysWhyAModelCannotBeFitted) {
  thread.begin(oscillator("no_such_effect"), {});
  thread.add(cycle(0), {});
  ASSERT_TRUE(have(1));
  ASSERT_FALSE(outcomes[0].estimate);
  EXPECT_THAT(outcomes[0].estimate.error().what, ::testing::HasSubstr("no_such_effect"));
}

TEST_F(EstimatorThreadTest, ForgetsThePreviousCampaign) {
  thread.begin(oscillator(), {});
  for (long i = 0; i < 50; ++i)
    thread.add(cycle(i), {});
  thread.begin(oscillator(), {});
  thread.add(cycle(77), {});
  ASSERT_TRUE(have(1));
  EXPECT_EQ(outcomes[0].cycle, 77);
  ASSERT_TRUE(outcomes[0].estimate);
  EXPECT_EQ(outcomes[0].estimate->cycles, 1);
  EXPECT_EQ(outcomes[0].cycles_skipped, 0);
}

TEST(EstimatorThreadWaves, ShowTheCycleAndTheModelsResponse) {
  RealClock clock;
  Waker waker;
  WaveBox waves;
  EstimatorThread thread(clock, waker, &waves);
  thread.begin(oscillator(), {});
  thread.add(cycle(3), {});
  std::deque<protocol::WaveDocument> seen;
  ASSERT_TRUE(eventually([&] { return !(seen = waves.take()).empty(); }));
  const protocol::WaveDocument& wave = seen.front();
  EXPECT_EQ(wave.cycle, 3);
  EXPECT_TRUE(wave.accepted);
  EXPECT_EQ(wave.stroke_m, cycle(3).displacement);
  // The data are those of an exact oscillator, so the model misses nothing.
  ASSERT_EQ(wave.response_m.size(), wave.stroke_m.size());
  ASSERT_EQ(wave.missing_force_m_s2.size(), wave.stroke_m.size());
  for (std::size_t i = 0; i < wave.stroke_m.size(); ++i) {
    EXPECT_NEAR(wave.response_m[i], wave.stroke_m[i], 1e-7);
    EXPECT_NEAR(wave.missing_force_m_s2[i], 0.0, 1e-4);
  }
}

TEST(EstimatorThreadWaves, ShowTheCycleAloneWhereThereIsNoEstimate) {
  RealClock clock;
  Waker waker;
  WaveBox waves;
  EstimatorThread thread(clock, waker, &waves);
  thread.begin(oscillator("no_such_effect"), {});
  thread.add(cycle(0), {});
  std::deque<protocol::WaveDocument> seen;
  ASSERT_TRUE(eventually([&] { return !(seen = waves.take()).empty(); }));
  EXPECT_EQ(seen.front().stroke_m, cycle(0).displacement);
  EXPECT_TRUE(seen.front().response_m.empty());
}

TEST(WaveBox, KeepsTheNewest) {
  WaveBox waves;
  for (int i = 0; i < 100; ++i) {
    protocol::WaveDocument wave;
    wave.cycle = i;
    waves.put(wave);
  }
  const auto kept = waves.take();
  ASSERT_EQ(kept.size(), WaveBox::kMaxWaves);
  EXPECT_EQ(kept.front().cycle, 100 - static_cast<int>(WaveBox::kMaxWaves));
  EXPECT_EQ(kept.back().cycle, 99);
  EXPECT_TRUE(waves.take().empty());
}

}  // namespace
}  // namespace shaker::daemon
