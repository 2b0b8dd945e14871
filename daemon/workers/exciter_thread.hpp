// Communicates with the exciter, so that no other thread waits for it.
//
// Orders go into a mailbox: the newest setpoint replaces an older one that was not written yet.
// A stop overtakes all other orders and is repeated until the device has taken it. Between
// orders the thread sends the heartbeat and reads the status. When it ends, it stops the
// exciter.
//
// The heartbeat is sent only while every thread in `watch` has advanced within its bound. If
// one is overdue, this thread withholds the heartbeat, stops the exciter, and refuses setpoints
// until the engine calls keep_alive(false). Time in which this thread itself got no processor
// does not count: if the whole machine stood still, the dead-man acts.
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

// A thread that must advance while the table moves.
struct Watched {
  std::string name;  // for the message: "the engine"
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
  // Replaces the list; an empty list watches nothing. Returns when the old list is no longer in
  // use.
  void watch(std::vector<Watched> watched);
  // Stops at once and refuses setpoints, as an overdue thread does.
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
  void turn();
  void stop_by_itself();
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
  std::atomic<bool> barred_{false};  // refuses setpoints until keep_alive(false)

  struct Seen {
    Nanoseconds progress{}, starved{};
  };
  std::mutex watch_mutex_;
  std::vector<Watched> watched_;
  std::vector<Seen> seen_;  // for each of watched_

  // of the thread
  Nanoseconds starved_{};  // total time without a processor
  Orders pending_;         // taken from the mailbox, not yet done
  Nanoseconds next_connect_{}, pause_, next_heartbeat_{}, next_poll_{};
  std::optional<Nanoseconds> last_heartbeat_;  // empty while no heartbeat is wanted
  std::atomic<bool> connected_{false};
  bool threw_ = false;      // and the engine has not been told
  bool made_safe_ = false;  // stopped once since the process started; worker thread only
  std::atomic<std::int64_t> progress_;
  std::jthread thread_;  // last
};

}  // namespace shaker::daemon
