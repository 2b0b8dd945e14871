#include "daemon/workers/acquisition_thread.hpp"

#include <array>

#include <poll.h>

#include "tests/daemon/workers/eventually.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using testing::eventually;

// The script of the test and its observations; it outlives the thread.
struct Script {
  std::atomic<int> connects{0}, refuse_connects{0}, fail_reads{0}, throwing_reads{0};
  std::atomic<std::int64_t> available{0};  // samples that may be read
  std::atomic<bool> finished{false};
};

class ScriptedSensor final : public drivers::Sensor {
 public:
  explicit ScriptedSensor(Script& script) : script_(script) {}
  std::string description() const override { return "scripted"; }
  std::vector<protocol::Channel> channels() const override {
    return {protocol::Channel::displacement};
  }
  drivers::StampSource stamp_source() const override { return drivers::StampSource::device; }
  Result<void> connect() override {
    ++script_.connects;
    if (script_.refuse_connects > 0) {
      --script_.refuse_connects;
      return Error{ErrorKind::unavailable, "The sensor is not there."};
    }
    health_.link_up = true;
    return {};
  }
  Result<std::size_t> read(std::span<drivers::Sample> out, Nanoseconds) override {
    if (script_.fail_reads > 0) {
      --script_.fail_reads;
      health_.link_up = false;
      return Error{ErrorKind::io, "The link is gone."};
    }
    if (script_.throwing_reads > 0) {
      --script_.throwing_reads;
      throw std::bad_alloc();
    }
    const auto count = std::min(script_.available.load(), static_cast<std::int64_t>(out.size()));
    if (count == 0) std::this_thread::sleep_for(200us);
    for (auto& sample : out.first(static_cast<std::size_t>(count))) {
      sample.t = Nanoseconds(next_++);
      ++health_.samples;
    }
    script_.available -= count;
    return static_cast<std::size_t>(count);
  }
  drivers::SensorHealth health() const override { return health_; }
  bool finished() const override { return script_.finished; }

 private:
  Script& script_;
  drivers::SensorHealth health_;
  std::int64_t next_ = 0;
};

class AcquisitionTest : public ::testing::Test {
 protected:
  std::unique_ptr<AcquisitionThread> make(AcquisitionOptions options = {}) {
    options.first_pause = 1ms;
    options.health_period = 0ms;
    return std::make_unique<AcquisitionThread>(std::make_unique<ScriptedSensor>(script), clock,
                                               waker, options);
  }
  RealClock clock;
  Waker waker;
  Script script;
};

TEST_F(AcquisitionTest, HandsOverEverySampleInOrderAndWakesTheLoop) {
  script.available = 100'000;
  AcquisitionOptions options;
  options.ring = 100'000;
  auto thread = make(options);
  std::array<drivers::Sample, 333> part;
  std::int64_t expected = 0;
  EXPECT_TRUE(eventually([&] {
    waker.clear();
    while (const auto count = thread->drain(part)) {
      for (std::size_t i = 0; i < count; ++i)
        EXPECT_EQ(part[i].t.count(), expected++);
    }
    return expected == 100'000;
  }));
  EXPECT_EQ(thread->overflows(), 0U);
  script.available = 1;
  pollfd ready{waker.fd(), POLLIN, 0};
  EXPECT_EQ(::poll(&ready, 1, 10'000), 1);
  EXPECT_TRUE(eventually([&] { return thread->drain(part) == 1; }));
  EXPECT_EQ(thread->stamp_source(), drivers::StampSource::device);
}

TEST_F(AcquisitionTest, ShowsTheSamplesOnceMoreToThoseWhoLookOn) {
  AcquisitionOptions options;
  options.view_ring = 100;
  auto thread = make(options);
  std::array<drivers::Sample, 4096> part, shown;
  script.available = 10;
  EXPECT_TRUE(eventually([&] { return thread->drain(part) > 0; }));
  EXPECT_EQ(thread->drain_view(shown), 0U);  // nobody looks on
  thread->view(true);
  script.available = 50;
  std::size_t seen = 0;
  EXPECT_TRUE(eventually([&] { return (seen += thread->drain_view(shown)) >= 50; }));
  // Nobody drains that ring any more: the engine still gets every sample.
  std::size_t all = thread->drain(part);
  script.available = 1000;
  EXPECT_TRUE(eventually([&] { return (all += thread->drain(part)) >= 1050; }));
  EXPECT_EQ(thread->overflows(), 0U);
  EXPECT_LE(thread->drain_view(shown), 100U);
}

TEST_F(AcquisitionTest, CountsWhatFindsTheRingFullAndNeverWaits) {
  script.available = 50'000;
  AcquisitionOptions options;
  options.ring = 1000;
  auto thread = make(options);
  EXPECT_TRUE(eventually([&] { return script.available == 0; }));
  // Two steps: the first one is the end of the last read, before its samples are in the ring.
  for (int turn = 0; turn < 2; ++turn) {
    const Nanoseconds then = clock.now();
    EXPECT_TRUE(eventually([&] { return thread->last_progress() > then; }));
  }
  std::array<drivers::Sample, 4096> part;
  std::uint64_t kept = 0;
  while (const auto count = thread->drain(part))
    kept += count;
  EXPECT_EQ(kept, 1000U);
  EXPECT_EQ(kept + thread->overflows(), 50'000U);
}

TEST_F(AcquisitionTest, ReconnectsTwiceInARow) {
  script.refuse_connects = 3;
  auto thread = make();
  for (int loss = 0; loss < 2; ++loss) {
    script.available = 10;
    EXPECT_TRUE(eventually([&] { return script.available == 0; }));
    script.fail_reads = 1;
    EXPECT_TRUE(eventually([&] { return script.fail_reads == 0; }));
    script.available = 10;
    EXPECT_TRUE(eventually([&] { return script.available == 0; }));
  }
  EXPECT_EQ(script.connects, 3 + 1 + 2);
  std::vector<Error> errors;
  bool link_up = false;
  EXPECT_TRUE(eventually([&] {
    auto report = thread->report();
    for (auto& error : report.errors)
      errors.push_back(error);
    if (report.health) link_up = report.health->link_up && report.health->samples == 40;
    return link_up;
  }));
  ASSERT_EQ(errors.size(), 5U);
  EXPECT_EQ(errors.front().what, "The sensor is not there.");
  EXPECT_EQ(errors.back().what, "The link is gone.");
}

TEST_F(AcquisitionTest, ConnectsAgainAndSaysSoAfterWantOfMemory) {
  auto thread = make();
  EXPECT_TRUE(eventually([&] { return script.connects == 1; }));
  script.throwing_reads = 2;
  std::vector<std::string> errors;
  EXPECT_TRUE(eventually([&] {
    for (const Error& error : thread->report().errors)
      errors.push_back(error.what);
    return script.connects == 3 && !errors.empty();
  }));
  EXPECT_THAT(errors.front(), ::testing::HasSubstr("want of memory"));
  script.available = 10;
  std::array<drivers::Sample, 16> part;
  EXPECT_TRUE(eventually([&] { return thread->drain(part) == 10; }));
}

TEST_F(AcquisitionTest, AdvancesWhileItWaitsForASensorThatIsAbsent) {
  script.refuse_connects = 1'000'000;
  auto thread = make();
  for (int i = 0; i < 3; ++i) {
    const Nanoseconds then = clock.now();
    EXPECT_TRUE(eventually([&] { return thread->last_progress() > then; }));
  }
}

TEST_F(AcquisitionTest, DoesNotWakeTheLoopWithoutASample) {
  auto thread = make();
  EXPECT_TRUE(eventually([&] { return script.connects == 1; }));
  for (int read = 0; read < 3; ++read) {
    const Nanoseconds then = clock.now();
    EXPECT_TRUE(eventually([&] { return thread->last_progress() > then; }));
  }
  pollfd ready{waker.fd(), POLLIN, 0};
  EXPECT_EQ(::poll(&ready, 1, 0), 0);
}

// Time passes only while the thread sleeps.
class SleepingClock final : public Clock {
 public:
  Nanoseconds now() const override { return Nanoseconds(now_.load()); }
  Nanoseconds utc() const override { return now(); }
  void sleep_until(Nanoseconds monotonic) override { now_ = monotonic.count(); }

 private:
  std::atomic<std::int64_t> now_{0};
};

// It refuses every connection, and notes when it was asked.
class AbsentSensor final : public drivers::Sensor {
 public:
  AbsentSensor(const Clock& clock, std::vector<Nanoseconds>& asked, std::atomic<bool>& enough)
      : clock_(clock), asked_(asked), enough_(enough) {}
  std::string description() const override { return "absent"; }
  std::vector<protocol::Channel> channels() const override { return {}; }
  drivers::StampSource stamp_source() const override { return drivers::StampSource::device; }
  Result<void> connect() override {
    if (!enough_) asked_.push_back(clock_.now());
    if (asked_.size() == 12) enough_ = true;
    return Error{ErrorKind::unavailable, "The sensor is not there."};
  }
  Result<std::size_t> read(std::span<drivers::Sample>, Nanoseconds) override {
    return std::size_t{0};
  }
  drivers::SensorHealth health() const override { return {}; }

 private:
  const Clock& clock_;
  std::vector<Nanoseconds>& asked_;
  std::atomic<bool>& enough_;
};

TEST_F(AcquisitionTest, AsksAnAbsentSensorAgainAfterPausesThatDoubleUpToTheLongest) {
  SleepingClock sleeping;
  std::vector<Nanoseconds> asked;
  std::atomic<bool> enough{false};
  const AcquisitionOptions options{.first_pause = 100ms, .longest_pause = 5s};
  {
    AcquisitionThread thread(std::make_unique<AbsentSensor>(sleeping, asked, enough), sleeping,
                             waker, options);
    EXPECT_TRUE(eventually([&] { return enough.load(); }));
  }
  ASSERT_EQ(asked.size(), 12U);
  Nanoseconds pause = 100ms;
  for (std::size_t i = 1; i < asked.size(); ++i) {
    EXPECT_EQ(asked[i] - asked[i - 1], pause) << i;
    pause = std::min<Nanoseconds>(2 * pause, 5s);
  }
}

TEST_F(AcquisitionTest, SaysWhenAReplayIsOver) {
  auto thread = make();
  EXPECT_FALSE(thread->finished());
  script.finished = true;
  EXPECT_TRUE(eventually([&] { return thread->finished(); }));
}

}  // namespace
}  // namespace shaker::daemon
