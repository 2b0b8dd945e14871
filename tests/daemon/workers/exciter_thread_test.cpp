#include "daemon/workers/exciter_thread.hpp"

#include <filesystem>
#include <fstream>

#include "tests/daemon/workers/eventually.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using testing::eventually;

// The device from the test's view; it outlives the thread.
struct Device {
  std::mutex mutex;
  std::vector<std::string> calls;  // without reads and heartbeats
  int heartbeats = 0, refuse_stops = 0, refuse_connects = 0;
  bool lose_link = false, no_memory = false;
  std::atomic<bool> hold_writes{false}, writing{false};

  void note(std::string what) {
    const std::lock_guard lock(mutex);
    calls.push_back(std::move(what));
  }
  std::vector<std::string> seen() {
    const std::lock_guard lock(mutex);
    return calls;
  }
};

class DeviceExciter final : public drivers::Exciter {
 public:
  explicit DeviceExciter(Device& device) : device_(device) {}
  std::string description() const override { return "device"; }
  Result<void> connect() override {
    device_.note("connect");
    const std::lock_guard lock(device_.mutex);
    if (device_.refuse_connects > 0 && device_.refuse_connects-- > 0) {
      return Error{ErrorKind::unavailable, "The exciter is not there."};
    }
    return {};
  }
  Result<void> write(const drivers::Setpoint& setpoint) override {
    device_.writing = true;
    while (device_.hold_writes)
      std::this_thread::sleep_for(200us);
    device_.writing = false;
    device_.note("write " + std::to_string(static_cast<int>(setpoint.amplitude)));
    return {};
  }
  Result<drivers::ExciterStatus> read() override {
    const std::lock_guard lock(device_.mutex);
    if (std::exchange(device_.lose_link, false)) {
      return Error{ErrorKind::unavailable, "The link is gone."};
    }
    if (std::exchange(device_.no_memory, false)) throw std::bad_alloc();
    drivers::ExciterStatus status;
    status.ready = true;
    return status;
  }
  Result<void> heartbeat() override {
    const std::lock_guard lock(device_.mutex);
    ++device_.heartbeats;
    return {};
  }
  Result<void> stop() override {
    device_.note("stop");
    const std::lock_guard lock(device_.mutex);
    if (device_.refuse_stops > 0 && device_.refuse_stops-- > 0) {
      return Error{ErrorKind::timeout, "The exciter does not answer."};
    }
    return {};
  }

 private:
  Device& device_;
};

class ExciterTest : public ::testing::Test {
 protected:
  std::unique_ptr<ExciterThread> make() {
    return std::make_unique<ExciterThread>(std::make_unique<DeviceExciter>(device), clock, waker,
                                           ExciterOptions{5ms, 5ms, 2ms, 20ms});
  }
  static drivers::Setpoint setpoint(double amplitude) { return {2.0, amplitude, true, 1.0}; }

  RealClock clock;
  Waker waker;
  Device device;
};

TEST_F(ExciterTest, BeginsWithAStopThenWritesSetpointsAndReadsStatus) {
  auto thread = make();
  thread->set(setpoint(1));
  EXPECT_TRUE(eventually([&] { return device.seen().size() == 3; }));
  EXPECT_THAT(device.seen(), ElementsAre("connect", "stop", "write 1"));
  EXPECT_TRUE(thread->connected());
  bool ready = false;
  EXPECT_TRUE(eventually([&] {
    for (const auto& news : thread->take()) {
      if (const auto* status = std::get_if<drivers::ExciterStatus>(&news)) ready = status->ready;
    }
    return ready;
  }));
}

// The name is what top, gdb and a frozen thread's report show.
TEST_F(ExciterTest, HasTheNameOfItsThread) {
  const auto thread = make();
  const auto named = [] {
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
      std::string name;
      std::getline(std::ifstream(task.path() / "comm"), name);
      if (name == "exciter") return true;
    }
    return false;
  };
  EXPECT_TRUE(eventually(named));
}

// Heartbeats come once a period (50 ms), not in every turn of the thread.
TEST_F(ExciterTest, BeatsOnceAPeriod) {
  const auto thread = std::make_unique<ExciterThread>(
      std::make_unique<DeviceExciter>(device), clock, waker, ExciterOptions{50ms, 5ms, 2ms, 20ms});
  const Nanoseconds began = clock.now();
  thread->keep_alive(true);
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard lock(device.mutex);
    return device.heartbeats >= 6;
  }));
  thread->keep_alive(false);
  const std::lock_guard lock(device.mutex);
  EXPECT_LE(device.heartbeats, 2 + (clock.now() - began) / 50ms);
}

TEST_F(ExciterTest, LetsAStopOvertakeWhatIsQueued) {
  auto thread = make();
  device.hold_writes = true;
  thread->set(setpoint(1));
  EXPECT_TRUE(eventually([&] { return device.writing.load(); }));
  thread->set(setpoint(2));
  thread->stop();
  device.hold_writes = false;
  EXPECT_TRUE(eventually([&] { return device.seen().size() >= 4; }));
  std::this_thread::sleep_for(30ms);  // time to write the obsolete setpoint, if it did that
  EXPECT_THAT(device.seen(), ElementsAre("connect", "stop", "write 1", "stop"));
  thread->set(setpoint(3));
  EXPECT_TRUE(eventually([&] { return device.seen().size() == 5; }));
  EXPECT_EQ(device.seen().back(), "write 3");
}

TEST_F(ExciterTest, RepeatsAStopUntilTheDeviceHasTakenIt) {
  auto thread = make();
  EXPECT_TRUE(eventually([&] { return thread->connected(); }));
  {
    const std::lock_guard lock(device.mutex);
    device.refuse_stops = 3;
  }
  thread->stop();
  EXPECT_TRUE(eventually([&] { return device.seen().size() == 6; }));
  EXPECT_THAT(device.seen(), ElementsAre("connect", "stop", "stop", "stop", "stop", "stop"));
}

TEST_F(ExciterTest, StopsEvenWhenItIsNotConnected) {
  device.refuse_connects = 1'000'000;
  auto thread = make();
  thread->set(setpoint(1));
  thread->stop();
  EXPECT_TRUE(eventually([&] {
    const auto seen = device.seen();
    return std::ranges::find(seen, "stop") != seen.end();
  }));
}

TEST_F(ExciterTest, KeepsTheDeadManAliveOnlyWhileAsked) {
  auto thread = make();
  EXPECT_TRUE(eventually([&] { return thread->connected(); }));
  const auto beats = [&] {
    const std::lock_guard lock(device.mutex);
    return device.heartbeats;
  };
  EXPECT_EQ(beats(), 0);
  thread->keep_alive(true);
  EXPECT_TRUE(eventually([&] { return beats() >= 3; }));
  thread->keep_alive(false);
  const Nanoseconds then = clock.now();  // one may be under way until the turn ends
  EXPECT_TRUE(eventually([&] { return thread->last_progress() > then; }));
  const int last = beats();
  std::this_thread::sleep_for(30ms);
  EXPECT_EQ(beats(), last);
}

TEST_F(ExciterTest, TellsThatAHeartbeatCameLate) {
  auto thread = make();
  thread->keep_alive(true);
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard lock(device.mutex);
    return device.heartbeats > 0;
  }));
  device.hold_writes = true;
  const Nanoseconds held = clock.now();
  thread->set(setpoint(1));
  EXPECT_TRUE(eventually([&] { return device.writing.load(); }));
  EXPECT_TRUE(eventually([&] { return clock.now() - held > 60ms; }));
  thread->take();
  device.hold_writes = false;
  Nanoseconds longest{};
  EXPECT_TRUE(eventually([&] {
    for (const auto& news : thread->take()) {
      const auto* late = std::get_if<ExciterThread::Late>(&news);
      if (late != nullptr) longest = std::max(longest, late->gap);
    }
    return longest >= 40ms;
  }));
}

TEST_F(ExciterTest, ReconnectsAndTellsTheErrors) {
  device.refuse_connects = 2;
  auto thread = make();
  EXPECT_TRUE(eventually([&] { return thread->connected(); }));
  {
    const std::lock_guard lock(device.mutex);
    device.lose_link = true;
  }
  EXPECT_TRUE(eventually([&] { return device.seen().size() == 5 && thread->connected(); }));
  std::vector<std::string> errors;
  for (const auto& news : thread->take()) {
    if (const auto* error = std::get_if<Error>(&news)) errors.push_back(error->what);
  }
  EXPECT_THAT(errors, ElementsAre("The exciter is not there.", "The exciter is not there.",
                                  "The link is gone."));
}

TEST_F(ExciterTest, StopsTheExciterWhenItEnds) {
  auto thread = make();
  thread->set(setpoint(1));
  EXPECT_TRUE(eventually([&] { return device.seen().size() == 3; }));
  thread.reset();
  EXPECT_EQ(device.seen().back(), "stop");
}

// The heartbeat depends on the supervised threads.
class ExciterWatchTest : public ExciterTest {
 protected:
  std::unique_ptr<ExciterThread> beating() {
    auto thread = make();
    advance();
    thread->watch({{"the engine", 100ms, [this] { return Nanoseconds(progress.load()); }}});
    EXPECT_TRUE(eventually([&] { return thread->connected(); }));
    thread->keep_alive(true);
    return thread;
  }
  void advance() { progress = clock.now().count(); }
  int beats() {
    const std::lock_guard lock(device.mutex);
    return device.heartbeats;
  }
  std::string withheld(ExciterThread& thread) {
    for (const auto& news : thread.take()) {
      if (const auto* w = std::get_if<ExciterThread::Withheld>(&news)) why = w->why;
    }
    return why;
  }

  std::atomic<std::int64_t> progress{0};
  std::string why;
};

TEST_F(ExciterWatchTest, BeatsWhileWhatIsWatchedAdvances) {
  auto thread = beating();
  const int before = beats();
  EXPECT_TRUE(eventually([&] {
    advance();
    return beats() > before + 40;
  }));
  EXPECT_EQ(withheld(*thread), "");
}

TEST_F(ExciterWatchTest, StopsTheExciterWhenItsOwnThreadIsInterrupted) {
  auto thread = make();
  thread->keep_alive(true);
  thread->set(setpoint(1));
  EXPECT_TRUE(eventually([&] { return device.seen().size() == 3; }));
  {
    const std::lock_guard lock(device.mutex);
    device.no_memory = true;
  }
  EXPECT_TRUE(eventually([&] { return !withheld(*thread).empty(); }));
  EXPECT_THAT(why, ::testing::HasSubstr("want of memory"));
  EXPECT_TRUE(eventually([&] { return device.seen().back() == "stop"; }));
  thread->set(setpoint(2));  // barred: the engine has not withdrawn the heartbeat
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(device.seen().back(), "stop");
  thread->keep_alive(false);
  thread->set(setpoint(3));
  EXPECT_TRUE(eventually([&] { return device.seen().back() == "write 3"; }));
}

TEST_F(ExciterWatchTest, StopsTheExciterWhenSomethingStandsStill) {
  auto thread = beating();
  thread->set(setpoint(1));
  EXPECT_TRUE(eventually([&] { return !withheld(*thread).empty(); }));
  EXPECT_THAT(why, ::testing::HasSubstr("the engine has not advanced for"));
  EXPECT_TRUE(eventually([&] { return device.seen().back() == "stop"; }));
  const int before = beats();
  // The stuck thread continues and knows nothing of this yet: motion must not restart by
  // itself.
  advance();
  thread->set(setpoint(2));
  thread->keep_alive(true);
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(device.seen().back(), "stop");
  EXPECT_EQ(beats(), before);
  thread->stop();
  thread->keep_alive(false);  // the engine has noticed it
  thread->set(setpoint(3));
  EXPECT_TRUE(eventually([&] { return device.seen().back() == "write 3"; }));
}

TEST_F(ExciterWatchTest, AnEmergencyStopNeedsNobodyElse) {
  auto thread = beating();
  thread->set(setpoint(1));
  EXPECT_TRUE(eventually([&] { return device.seen().back() == "write 1"; }));
  thread->emergency_stop();
  EXPECT_TRUE(eventually([&] { return device.seen().back() == "stop"; }));
  thread->set(setpoint(2));
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(device.seen().back(), "stop");
}

// A refused stop is repeated. The exciter's status is still read, because the engine must learn
// that the exciter runs.
TEST_F(ExciterTest, ReadsTheStatusWhileAStopIsRefused) {
  auto thread = make();
  EXPECT_TRUE(eventually([&] { return thread->connected(); }));
  {
    const std::lock_guard lock(device.mutex);
    device.refuse_stops = 1'000'000;
  }
  thread->stop();
  EXPECT_TRUE(eventually([&] { return device.seen().size() > 4; }));
  thread->take();
  EXPECT_TRUE(eventually([&] {
    for (const auto& news : thread->take())
      if (std::holds_alternative<drivers::ExciterStatus>(news)) return true;
    return false;
  }));
  const std::lock_guard lock(device.mutex);
  device.refuse_stops = 0;
}

// The first stop of a process is repeated until the device accepts it.
TEST_F(ExciterTest, MakesSafeUntilTheDeviceHasTakenIt) {
  device.refuse_stops = 3;
  auto thread = make();
  EXPECT_TRUE(eventually([&] { return std::ranges::count(device.seen(), "stop") >= 4; }));
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(std::ranges::count(device.seen(), "stop"), 4);
}

}  // namespace
}  // namespace shaker::daemon
