// Speaks to the exciter, so that nobody else waits for it.
//
// Orders lie in a mailbox: the newest setpoint replaces an older one that was not written yet, and
// a stop overtakes everything and is repeated until the device has taken it. Between orders the
// thread keeps the device's dead-man alive and reads its status. When it ends, it stops the
// exciter.
//
// The heartbeat proves that somebody watches: it is served only while everything in `watch` has
// advanced within its bound. What is overdue withholds it, stops the exciter, and bars every
// setpoint until the engine has taken back its wish for a heartbeat. Time in which this thread
// itself was not given a processor does not count: a machine that stood still as a whole is the
// dead-man's affair.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "base/clock.hpp"
#include "daemon/engine.hpp"
#include "daemon/workers/waker.hpp"
#include "drivers/exciter.hpp"

namespace shaker::daemon {

struct ExciterOptions {
  Nanoseconds heartbeat_period = std::chrono::milliseconds(100);
  Nanoseconds poll_period = std::chrono::milliseconds(100);
  Nanoseconds first_pause = std::chrono::milliseconds(100);  // before reconnecting; doubles
  Nanoseconds longest_pause = std::chrono::seconds(5);
};

// What must advance while the table moves.
struct Watched {
  std::string name;  // for the sentence: "the engine"
  Nanoseconds bound{};
  std::function<Nanoseconds()> last_progress;  // neither blocks nor allocates
};

class ExciterThread final : public ExciterCommands {
 public:
  // Starts at once. `clock` and `waker` outlive it.
  ExciterThread(std::unique_ptr<drivers::Exciter> exciter, Clock& clock, Waker& waker,
                ExciterOptions options);
  ~ExciterThread() override;

  // --- orders, from the engine's thread
  void set(const drivers::Setpoint& setpoint) override;
  void stop() override;
  void keep_alive(bool wanted) override;
  void clear_fault() override;

  // --- any thread
  // Replaces what is watched; an empty list watches nothing. Returns when the old list is no longer
  // looked at.
  void watch(std::vector<Watched> watched);
  // Stops at once and bars setpoints, as something overdue does.
  void emergency_stop();

  struct Withheld {
    std::string why;  // a sentence
  };
  struct Late {
    Nanoseconds gap{};  // between two heartbeats, three periods or more
  };
  using News = std::variant<drivers::ExciterStatus, Error, Withheld, Late>;
  std::vector<News> take();
  bool connected() const { return connected_.load(); }
  Nanoseconds last_progress() const { return Nanoseconds(progress_.load()); }

 private:
  struct Orders {
    std::optional<drivers::Setpoint> setpoint;
    bool stop = false;
    bool clear_fault = false;
  };

  void work(const std::stop_token& token);
  void wait_for_orders(const std::stop_token& token);
  void watch_over();
  void obey();
  void connect_when_due();
  void keep_alive_when_due();
  void poll_when_due();
  void tell(News news);
  bool good(const Result<void>& outcome);

  std::unique_ptr<drivers::Exciter> exciter_;
  Clock& clock_;
  Waker& waker_;
  ExciterOptions options_;

  std::mutex mutex_;
  std::condition_variable_any ordered_;
  Orders mailbox_;
  std::vector<News> news_;
  std::atomic<bool> keep_alive_{false};
  std::atomic<bool> barred_{false};  // setpoints, until the engine takes back its keep_alive

  struct Seen {
    Nanoseconds progress{}, starved{};
  };
  std::mutex watch_mutex_;
  std::vector<Watched> watched_;
  std::vector<Seen> seen_;  // of each

  // of the thread
  Nanoseconds starved_{};  // time without a processor so far
  Orders pending_;         // taken out of the mailbox, not yet done
  Nanoseconds next_connect_{}, pause_, next_heartbeat_{}, next_poll_{};
  std::optional<Nanoseconds> last_heartbeat_;  // while it is wanted
  std::atomic<bool> connected_{false};
  bool made_safe_ = false;  // stopped once since the start of the process; the worker only
  std::atomic<std::int64_t> progress_;
  std::jthread thread_;  // last
};

}  // namespace shaker::daemon
