// Speaks to the exciter, so that nobody else waits for it.
//
// Orders lie in a mailbox: the newest setpoint replaces an older one that was not written yet, and
// a stop overtakes everything and is repeated until the device has taken it. Between orders the
// thread keeps the device's dead-man alive and reads its status. When it ends, it stops the
// exciter.
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
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

  // --- the main loop
  using News = std::variant<drivers::ExciterStatus, Error>;
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

  // of the thread
  Orders pending_;  // taken out of the mailbox, not yet done
  Nanoseconds next_connect_{}, pause_, next_heartbeat_{}, next_poll_{};
  std::atomic<bool> connected_{false};
  bool made_safe_ = false;  // stopped once since the start of the process; the worker only
  std::atomic<std::int64_t> progress_;
  std::jthread thread_;  // last
};

}  // namespace shaker::daemon
