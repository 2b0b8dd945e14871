// Runs the engine on a thread of its own, so that no client can delay it.
//
// Whenever a worker wakes it, the thread drains the sensors' ring buffers, the messages of the
// exciter and the estimates, and runs the tasks of other threads. It calls Engine::tick every 5
// ms on absolute deadlines. It reads no file and parses nothing: others pass ready values. The
// exciter's thread detects a stuck engine by `last_progress`.
#pragma once

#include <array>
#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "base/clock.hpp"
#include "daemon/engine.hpp"
#include "daemon/workers/acquisition_thread.hpp"
#include "daemon/workers/estimator_thread.hpp"
#include "daemon/workers/exciter_thread.hpp"
#include "daemon/workers/waker.hpp"

namespace shaker::daemon {

using Sensors = std::vector<std::unique_ptr<AcquisitionThread>>;

class RigThread {
 public:
  // Starts at once. The workers wake `waker`. All arguments outlive it.
  RigThread(Engine& engine, Sensors& sensors, ExciterThread& exciter, EstimatorThread& estimator,
            Clock& clock, Waker& waker);
  ~RigThread();

  // --- any other thread
  // Runs `task` between two ticks and waits for its result, at most half a second; then returns
  // an Error (timeout) that says what becomes of it. A task that has not begun by then is dropped.
  // Of one that has begun and ends well later, `undo` takes back the effect before the next tick;
  // without `undo` the effect stays.
  using Task = std::function<Result<void>(Engine&)>;
  Result<void> ask(Task task, Task undo = {});
  Result<void> ask_urgently(Task task);          // never dropped
  void tell(std::function<void(Engine&)> task);  // does not wait

  State state() const { return engine_.state(); }
  protocol::StateDocument state_document() const;   // as of the last tick
  double ramp_s() const { return ramp_s_.load(); }  // of the current campaign, s
  std::optional<Engine::DeadmanSeen> deadman_seen() const;
  void set_client_count(int clients) { clients_ = clients; }
  // The clients' thread calls this every few milliseconds to show that it is alive.
  void clients_are_heard() { heard_ = clock_.now().count(); }
  Nanoseconds last_progress() const { return Nanoseconds(progress_.load()); }
  Nanoseconds take_latest() { return Nanoseconds(late_max_.exchange(0)); }  // largest delay

 private:
  struct Question;
  void work(const std::stop_token& stop);
  void serve(Nanoseconds& due);
  void wait(Nanoseconds due);
  void turn();
  void hear_the_exciter_first();
  void drain_sensors();
  void drain_workers();
  void watch_the_others();
  void answer();
  static bool answer(Question& question, const Result<void>& said);
  std::size_t questions() const;
  Result<void> wait_for_answer(Task task, Task undo, bool urgent);
  void show_state();

  Engine& engine_;
  Sensors& sensors_;
  ExciterThread& exciter_;
  EstimatorThread& estimator_;
  Clock& clock_;
  Waker& waker_;

  std::atomic<std::int64_t> progress_, heard_, late_max_{0};
  std::atomic<double> ramp_s_{0.0};
  std::atomic<int> clients_{0};
  mutable std::mutex mutex_;
  std::deque<std::shared_ptr<Question>> questions_;
  std::shared_ptr<const protocol::StateDocument> shown_;
  std::optional<Engine::DeadmanSeen> deadman_seen_;

  // of the thread
  bool threw_ = false;  // and the engine has not been told
  std::vector<drivers::SensorHealth> healths_;
  std::array<drivers::Sample, 4096> samples_;
  std::jthread thread_;  // last
};

}  // namespace shaker::daemon
