// Reads one sensor continuously and never waits for another thread.
//
// Samples go into a bounded single-producer ring buffer. Samples that find it full are dropped
// and counted. If the link is lost, the thread reconnects with a pause that doubles. On the
// path of a sample it does not log, does not allocate, and takes no lock that is held during
// work.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include <boost/lockfree/spsc_queue.hpp>

#include "base/clock.hpp"
#include "daemon/workers/waker.hpp"
#include "drivers/sensor.hpp"

namespace shaker::daemon {

struct AcquisitionOptions {
  std::size_t ring = 65'536;       // samples: 0.8 s of eight channels at 10 kHz
  std::size_t view_ring = 16'384;  // samples that wait for those who look on
  Nanoseconds read_timeout = std::chrono::milliseconds(50);
  Nanoseconds first_pause = std::chrono::milliseconds(100);  // before reconnecting; doubles
  Nanoseconds longest_pause = std::chrono::seconds(5);
  Nanoseconds health_period = std::chrono::milliseconds(100);
};

class AcquisitionThread {
 public:
  // Starts at once. `clock` and `waker` outlive it.
  AcquisitionThread(std::unique_ptr<drivers::Sensor> sensor, Clock& clock, Waker& waker,
                    AcquisitionOptions options = {});
  ~AcquisitionThread();

  // --- the engine's thread
  std::size_t drain(std::span<drivers::Sample> out);
  struct Report {
    std::optional<drivers::SensorHealth> health;  // if there is a newer one
    std::vector<Error> errors;                    // since the last call
  };
  Report report();
  drivers::StampSource stamp_source() const { return stamps_.load(); }
  std::uint64_t overflows() const { return overflows_.load(); }
  Nanoseconds last_progress() const { return Nanoseconds(progress_.load()); }
  bool finished() const { return finished_.load(); }  // a replay has delivered its last sample

  // --- the clients' thread: the same samples once more, for those who look on. Samples that find
  // that ring full are dropped.
  void view(bool wanted) { viewed_ = wanted; }
  std::size_t drain_view(std::span<drivers::Sample> out);

 private:
  void work(const std::stop_token& stop);
  bool connect(const std::stop_token& stop);
  bool read_once();
  void tell_health(bool must);
  void pause(const std::stop_token& stop, Nanoseconds duration);
  void advance();

  std::unique_ptr<drivers::Sensor> sensor_;
  Clock& clock_;
  Waker& waker_;
  AcquisitionOptions options_;
  boost::lockfree::spsc_queue<drivers::Sample> ring_, view_ring_;
  std::atomic<bool> viewed_{false};
  std::vector<drivers::Sample> buffer_;  // of the thread
  Nanoseconds next_health_{};
  std::atomic<std::uint64_t> overflows_{0};
  std::atomic<std::int64_t> progress_;
  std::atomic<drivers::StampSource> stamps_;
  std::atomic<bool> finished_{false};
  std::atomic<bool> threw_{false};  // and the engine has not been told
  std::mutex mutex_;
  Report report_;
  std::jthread thread_;  // last
};

}  // namespace shaker::daemon
