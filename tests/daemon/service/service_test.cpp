// The loop of the process: its ticks, the watchdog, and what people who look on are shown.
#include "daemon/service/service.hpp"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <optional>
#include <thread>

#include "config/json_tree.hpp"
#include "daemon/service/onlookers.hpp"
#include "tests/daemon/publish/server_fixture.hpp"
#include "tests/daemon/workers/eventually.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using record::testing::Scratch;
using testing::eventually;

// Counts how often the loop's thread asks it.
class ClockOfALoop final : public Clock {
 public:
  Nanoseconds now() const override {
    if (std::this_thread::get_id() == loop.load()) ++asked;
    return clock_.now();
  }
  Nanoseconds utc() const override { return clock_.utc(); }
  void sleep_until(Nanoseconds monotonic) override { clock_.sleep_until(monotonic); }
  std::atomic<std::thread::id> loop{};
  mutable std::atomic<long> asked{0};

 private:
  RealClock clock_;
};

// The socket of a service manager.
class Notified {
 public:
  explicit Notified(const std::filesystem::path& path)
      : fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.string().copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
    ::setenv("WATCHDOG_USEC", "400000", 1);
  }
  ~Notified() {
    ::unsetenv("NOTIFY_SOCKET");
    ::unsetenv("WATCHDOG_USEC");
  }
  int pings() {
    receive();
    return static_cast<int>(std::ranges::count(messages_, "WATCHDOG=1"));
  }
  // What follows `key` in the last message that begins with it; empty without one.
  std::string last(std::string_view key) {
    receive();
    const auto found = std::find_if(messages_.rbegin(), messages_.rend(),
                                    [&](const std::string& m) { return m.starts_with(key); });
    return found == messages_.rend() ? std::string() : found->substr(key.size());
  }

 private:
  void receive() {
    char text[256];
    for (ssize_t got = 0; (got = ::recv(fd_.get(), text, sizeof text, 0)) > 0;)
      messages_.emplace_back(text, static_cast<std::size_t>(got));
  }

  UniqueFd fd_;
  std::vector<std::string> messages_;
};

// A service on a virtual rig, with its loop on a thread.
class ServiceTest : public ::testing::Test {
 protected:
  ServiceTest() {
    ::pthread_sigmask(SIG_SETMASK, nullptr, &mask_);
    Service::block_signals();
    options_.rig = std::filesystem::path(SHAKER_SOURCE_DIR) / "config/examples/rig-simulated.json";
    options_.socket = scratch_.path() / "s.sock";
    options_.data = scratch_.path();
    const auto text = config::read_text(options_.rig);
    auto rig = config::parse_rig(*text, options_.rig.string());
    rig->directory = options_.rig.parent_path();
    auto devices = drivers::make_devices(*rig, clock_);
    auto made = Service::make(options_, *rig, std::move(*devices), clock_);
    EXPECT_TRUE(made.ok()) << made.error().what;
    service_ = std::move(*made);
    loop_ = std::thread([this] {
      clock_.loop = std::this_thread::get_id();
      status_ = service_->run();
    });
  }
  ~ServiceTest() override {
    end();
    service_.reset();
    ::pthread_sigmask(SIG_SETMASK, &mask_, nullptr);
  }
  void end() {
    if (!loop_.joinable()) return;
    ::kill(::getpid(), SIGTERM);
    loop_.join();
    EXPECT_EQ(status_, kGood);
  }

  sigset_t mask_{};
  Scratch scratch_;
  Notified notified_{scratch_.path() / "notify"};
  ClockOfALoop clock_;
  Options options_;
  std::unique_ptr<Service> service_;
  std::atomic<int> status_{-1};
  std::thread loop_;
};

TEST_F(ServiceTest, PingsTheWatchdogTwiceInItsTime) {
  const Nanoseconds began = clock_.now();
  EXPECT_TRUE(eventually([&] { return notified_.pings() >= 4; }));
  EXPECT_LE(notified_.pings(), 2 + (clock_.now() - began) / 200ms);
}

// A ramp may be longer than systemd waits for the end of a service.
TEST_F(ServiceTest, AsksSystemdForTheTimeOfTheRampDown) {
  EXPECT_TRUE(eventually([&] { return clock_.asked > 0; }));
  end();
  const std::string text = notified_.last("EXTEND_TIMEOUT_USEC=");
  ASSERT_FALSE(text.empty());
  const auto rig = config::parse_rig(*config::read_text(options_.rig), options_.rig.string());
  EXPECT_GT(std::stod(text) * 1e-6, rig->exciter.ramp_s);
}

TEST_F(ServiceTest, SleepsBetweenItsTicks) {
  EXPECT_TRUE(eventually([&] { return clock_.asked > 0; }));
  const long before = clock_.asked;
  const Nanoseconds began = clock_.now();
  std::this_thread::sleep_for(300ms);
  EXPECT_LT(clock_.asked - before, 60 * ((clock_.now() - began) / 5ms));
}

// The lines of the recorder wake the loop once, not again and again.
TEST_F(ServiceTest, TakesNoProcessorBetweenItsTicks) {
  EXPECT_TRUE(eventually([&] { return clock_.asked > 0; }));
  clockid_t time_of_the_loop{};
  ASSERT_EQ(::pthread_getcpuclockid(loop_.native_handle(), &time_of_the_loop), 0);
  const auto used = [&] {
    timespec time{};
    ::clock_gettime(time_of_the_loop, &time);
    return std::chrono::seconds(time.tv_sec) + Nanoseconds(time.tv_nsec);
  };
  const Nanoseconds before = used(), began = clock_.now();
  std::this_thread::sleep_for(600ms);
  EXPECT_LT(used() - before, (clock_.now() - began) / 5);
}

TEST(RigDocument, HoldsTheLimitsOfTheRigFile) {
  config::RigConfig rig;
  rig.name = "A";
  rig.limits.stroke_min_m = 0.01;
  rig.limits.stroke_max_m = 0.02;
  rig.limits.stroke_rate_max_m_s = 0.03;
  rig.limits.excitation_max_m_s2 = 4.0;
  rig.limits.frequency_min_hz = 5.0;
  rig.limits.frequency_max_hz = 6.0;
  rig.limits.stale_s = 0.7;
  rig.exciter.ramp_s = 0.8;
  rig.client_lease_s = 0.9;
  rig.unprotected = true;
  rig.sensors.emplace_back(config::SimulatedSensor{});
  const auto document = rig_document(rig);
  EXPECT_EQ(document.rig, "A");
  EXPECT_EQ(document.stroke_min_m, 0.01);
  EXPECT_EQ(document.stroke_max_m, 0.02);
  EXPECT_EQ(document.stroke_rate_max_m_s, 0.03);
  EXPECT_EQ(document.excitation_max_m_s2, 4.0);
  EXPECT_EQ(document.frequency_min_hz, 5.0);
  EXPECT_EQ(document.frequency_max_hz, 6.0);
  EXPECT_EQ(document.stale_s, 0.7);
  EXPECT_EQ(document.ramp_s, 0.8);
  EXPECT_EQ(document.client_lease_s, 0.9);
  EXPECT_TRUE(document.unprotected);
  ASSERT_EQ(document.channels.size(), 2u);
  EXPECT_EQ(document.channels[0].channel, "displacement");
}

TEST_F(ServiceTest, ShowsWhoIsInControlOnceForEachChange) {
  testing::TestClient client(options_.socket);
  client.send(R"({"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"documents":["rig"]}})"
              "\n"
              R"({"jsonrpc":"2.0","id":2,"method":"control.acquire"})"
              "\n");
  int shown = 0;
  const auto look = [&] {
    for (const json& line : client.lines())
      shown += line.value("type", "") == "rig" && line.contains("in_control") ? 1 : 0;
    return shown > 0;
  };
  EXPECT_TRUE(eventually(look));
  std::this_thread::sleep_for(100ms);  // twenty ticks
  look();
  EXPECT_EQ(shown, 1);
}

}  // namespace
}  // namespace shaker::daemon
