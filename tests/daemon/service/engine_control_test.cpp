// What a client is told, and what the engine does, when the engine answers late.
#include "daemon/service/engine_control.hpp"

#include <atomic>
#include <utility>

#include "tests/daemon/support/engine_bench.hpp"
#include "tests/daemon/workers/eventually.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using record::testing::Scratch;
using ::testing::AllOf;
using testing::eventually;
using ::testing::HasSubstr;

// An exciter at rest that takes everything.
class RestingExciter final : public drivers::Exciter {
 public:
  std::string description() const override { return "at rest"; }
  Result<void> connect() override { return {}; }
  Result<void> write(const drivers::Setpoint&) override { return {}; }
  Result<drivers::ExciterStatus> read() override {
    drivers::ExciterStatus status;
    status.ready = true;
    return status;
  }
  Result<void> heartbeat() override { return {}; }
  Result<void> stop() override { return {}; }
};

// Holds up the engine's thread where a campaign's file is opened.
class HoldingOutlet final : public Outlet {
 public:
  Result<void> record_campaign(const config::CampaignSpec&) override {
    opening = true;
    while (held)
      std::this_thread::sleep_for(1ms);
    return {};
  }
  Result<void> record_run(int, const config::RunSpec&) override { return {}; }
  Result<void> record_samples(std::span<const drivers::Sample>) override { return {}; }
  Result<void> record_cycle(const estimator::MeasuredCycle&, bool) override { return {}; }
  void close_campaign() override { ++closed; }
  Result<void> publish(const protocol::Document& document) override {
    estimates += std::holds_alternative<protocol::EstimateDocument>(document) ? 1 : 0;
    return {};
  }

  std::atomic<bool> held{false}, opening{false};
  std::atomic<int> closed{0}, estimates{0};
};

constexpr const char* kCampaign = R"({
  "format": "shaker-campaign/1",
  "name": "c",
  "model": {"name": "oleo", "effects": [{"effect": "orifice_damping"}, {"effect": "gas_spring"}]},
  "runs": [{"name": "r01", "frequency_hz": 5.0, "amplitude": 2.0, "cycles": 5}]
})";

// Counts how often it is asked, and can leave time out.
class CountingClock final : public Clock {
 public:
  Nanoseconds now() const override {
    ++asked;
    return clock_.now() + skipped_.load();
  }
  void skip(Nanoseconds time) { skipped_ = skipped_.load() + time; }
  Nanoseconds utc() const override { return clock_.utc(); }
  void sleep_until(Nanoseconds monotonic) override { clock_.sleep_until(monotonic); }
  mutable std::atomic<long> asked{0};

 private:
  RealClock clock_;
  std::atomic<Nanoseconds> skipped_{Nanoseconds{0}};
};

class EngineControlTest : public ::testing::Test {
 protected:
  ~EngineControlTest() override { outlet.held = false; }

  Result<void> start(const std::string& text = kCampaign) {
    return control.start("me", text, "test", "/");
  }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(scratch.path()), {}));
  }

  Scratch scratch;
  RealClock clock;
  Waker waker;
  HoldingOutlet outlet;
  Sensors sensors;
  ExciterThread exciter{std::make_unique<RestingExciter>(), clock, waker,
                        ExciterOptions{10ms, 10ms}};
  EstimatorThread estimator{clock, waker};
  Engine engine{shaker::testing::bench_rig(), clock, exciter, estimator, outlet};
  CountingClock clock_of_the_engine;
  RigThread rig{engine, sensors, exciter, estimator, clock_of_the_engine, waker};
  Recorder recorder{RecorderOptions{scratch.path(), "rig"}, clock, [] {},
                    [](protocol::HealthDocument&) {}};
  std::atomic<bool> checking{false};
  DiagnosisThread diagnosis{waker, {}};
  DiagnosisDesk desk{diagnosis, scratch.path(), checking};
  EngineControl control{rig, exciter, recorder, desk, 50.0};
};

TEST_F(EngineControlTest, StartsACampaign) {
  EXPECT_TRUE(start().ok());
  EXPECT_EQ(rig.state(), State::check);
  EXPECT_EQ(control.starter(), "me");
  ASSERT_TRUE(control.last_campaign());
  EXPECT_EQ(control.last_campaign()->name, "c");
}

// A tick every 5 ms, and a turn for each wake: not one turn after the other.
TEST_F(EngineControlTest, TheEnginesThreadSleepsBetweenItsTicks) {
  ASSERT_TRUE(rig.ask([](Engine&) { return Result<void>(); }).ok());
  const long before = clock_of_the_engine.asked;
  const Nanoseconds began = clock.now();
  std::this_thread::sleep_for(200ms);
  const auto ticks = (clock.now() - began) / 5ms;
  EXPECT_LT(clock_of_the_engine.asked - before, 40 * ticks);
}

TEST_F(EngineControlTest, TheEngineTicksEvery5Ms) {
  Nanoseconds last = rig.last_progress();
  int ticks = 0;
  EXPECT_TRUE(eventually([&] {
    ticks += std::exchange(last, rig.last_progress()) != last ? 1 : 0;
    return ticks >= 300;
  }));
}

// What the exciter's thread knows is heard before what the sensors show of a pause: it gets two
// turns, of 10 ms here.
TEST_F(EngineControlTest, TheEngineHearsTheExciterFirstAfterAPause) {
  ASSERT_TRUE(eventually([&] { return exciter.connected(); }));
  Nanoseconds longest{};
  for (int pause = 0; pause < 3; ++pause) {
    std::this_thread::sleep_for(20ms);
    clock_of_the_engine.skip(200ms);
    const Nanoseconds woken = clock.now();
    ASSERT_TRUE(rig.ask([&](Engine&) {
                     longest = std::max(longest, exciter.last_progress() - woken);
                     return Result<void>();
                   })
                    .ok());
  }
  EXPECT_GE(longest, 9ms);
}

TEST_F(EngineControlTest, TheEngineHearsOfEachEstimate) {
  ASSERT_TRUE(start().ok());
  ASSERT_TRUE(rig.ask([&](Engine&) {
                   estimator::MeasuredCycle cycle;
                   cycle.frequency_hz = 5.0;
                   cycle.amplitude = 2.0;
                   cycle.displacement.assign(64, 0.1);
                   estimator.add(cycle, clock.now());
                   return Result<void>();
                 })
                  .ok());
  EXPECT_TRUE(eventually([&] { return outlet.estimates == 1; }));
}

TEST_F(EngineControlTest, ProvesTheDeadmanWithAGentleCampaignOfThatName) {
  EXPECT_THAT(control.prove_deadman("me", 5.0, 5.1).error().what,
              HasSubstr("is no small amplitude"));
  ASSERT_TRUE(control.prove_deadman("me", 5.0, 5.0).ok());
  EXPECT_EQ(rig.state(), State::check);
  EXPECT_EQ(control.starter(), "me");
  ASSERT_TRUE(control.last_campaign());
  EXPECT_EQ(control.last_campaign()->name, "deadman-proof");
  EXPECT_EQ(control.last_campaign()->runs.at(0).amplitude, 5.0);
}

TEST_F(EngineControlTest, RemarksThatParametersOfGroupsAreTakenAsOne) {
  EXPECT_EQ(control.remark(), "");
  ASSERT_TRUE(start().ok());
  EXPECT_EQ(control.remark(), "");
  ASSERT_TRUE(control.stop("me").ok());
  std::string by_run = kCampaign;
  const std::string damping = R"("orifice_damping")";
  by_run.insert(by_run.find(damping) + damping.size(),
                R"(, "parameters": {"theta1": {"start": 13.3, "per": "group"}})");
  ASSERT_TRUE(start(by_run).ok());
  EXPECT_THAT(control.remark(), HasSubstr("takes theta1 as the same in all runs"));
}

// The engine has begun to start when its client gives up.
TEST_F(EngineControlTest, ACampaignWhoseClientWasToldThatItDoesNotBeginDoesNotBegin) {
  outlet.held = true;
  const auto told = start();
  ASSERT_FALSE(told.ok());
  EXPECT_THAT(told.error().what,
              AllOf(HasSubstr("does not answer within 0.5 s"), HasSubstr("takes no effect later")));
  EXPECT_TRUE(outlet.opening);
  EXPECT_EQ(files(), 0u);
  outlet.held = false;
  EXPECT_TRUE(eventually([&] { return outlet.closed == 1; }));
  std::this_thread::sleep_for(50ms);  // ten ticks
  EXPECT_EQ(rig.state(), State::idle);
  EXPECT_THAT(rig.state_document().reason, HasSubstr("would have come too late"));
  EXPECT_TRUE(start().ok());
}

// Runs `task` while the engine cannot begin with it within half a second.
Result<void> while_the_engine_is_busy(RigThread& rig, const std::function<Result<void>()>& task) {
  std::atomic<bool> busy{false}, held{true};
  rig.tell([&](Engine&) {
    busy = true;
    while (held)
      std::this_thread::sleep_for(1ms);
  });
  EXPECT_TRUE(eventually([&] { return busy.load(); }));
  auto told = task();
  held = false;
  EXPECT_TRUE(rig.ask([](Engine&) { return Result<void>(); }).ok());
  return told;
}

TEST_F(EngineControlTest, ARequestThatDidNotBeginInTimeIsDropped) {
  int done = 0;
  const auto told = while_the_engine_is_busy(rig, [&] {
    return rig.ask([&](Engine&) {
      ++done;
      return Result<void>();
    });
  });
  ASSERT_FALSE(told.ok());
  EXPECT_EQ(told.error().kind, ErrorKind::timeout);
  EXPECT_THAT(told.error().what, HasSubstr("takes no effect later"));
  EXPECT_EQ(done, 0);
}

TEST_F(EngineControlTest, AStopIsNeverDropped) {
  ASSERT_TRUE(start().ok());
  const auto told = while_the_engine_is_busy(rig, [&] { return control.stop("me"); });
  ASSERT_FALSE(told.ok());
  EXPECT_THAT(told.error().what, HasSubstr("takes effect when it runs again"));
  EXPECT_EQ(rig.state(), State::idle);
  EXPECT_EQ(rig.state_document().reason, "stopped by me");
}

// Nothing takes back what has begun without a way back, so its client is told so.
TEST_F(EngineControlTest, WhatHasBegunAndCannotBeTakenBackIsSaidToTakeEffect) {
  std::atomic<bool> held{true};
  std::atomic<int> done{0};
  const auto told = rig.ask([&](Engine&) {
    while (held)
      std::this_thread::sleep_for(1ms);
    ++done;
    return Result<void>();
  });
  held = false;
  ASSERT_FALSE(told.ok());
  EXPECT_THAT(told.error().what, HasSubstr("takes effect when it runs again"));
  EXPECT_TRUE(eventually([&] { return done == 1; }));
}

TEST_F(EngineControlTest, AnExceptionOfOneRequestLosesNoOther) {
  std::atomic<int> done{0};
  const auto told = while_the_engine_is_busy(rig, [&] {
    rig.tell([](Engine&) { throw std::bad_alloc(); });
    rig.tell([&](Engine&) { ++done; });
    return Result<void>();
  });
  EXPECT_TRUE(told.ok());
  EXPECT_EQ(done, 1);
}

}  // namespace
}  // namespace shaker::daemon
