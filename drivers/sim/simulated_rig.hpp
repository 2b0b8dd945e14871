// The virtual rig on the daemon's clock, shared by its exciter and its sensor.
//
// Thread-safe: in real time the exciter and the sensor have a thread each. Each access first
// advances the rig to clock.now(), so a command acts when it is given. Samples wait for the
// sensor in a queue of kQueue; older ones are overwritten and counted.
#pragma once

#include <mutex>
#include <vector>

#include "base/clock.hpp"
#include "sim/virtual_rig.hpp"

namespace shaker::drivers::sim {

class SimulatedRig {
 public:
  static constexpr std::size_t kQueue = 1 << 16;

  // `clock` must outlive it. Throws std::invalid_argument for invalid options.
  SimulatedRig(const shaker::sim::RigOptions& options, Clock& clock);

  Clock& clock() const { return clock_; }
  const shaker::sim::RigOptions& options() const { return options_; }

  // Calls `action(VirtualRig&)` at clock.now(), e.g. rig.at_now([](auto& r) { r.inject(fault);
  // }).
  template <class Action>
  auto at_now(Action&& action) {
    const std::scoped_lock lock(mutex_);
    catch_up();
    return action(rig_);
  }

  // Moves the oldest samples up to now into `out`, with the dropped ones, at most `most`;
  // returns their number.
  std::size_t take(std::vector<shaker::sim::RigSample>& out, std::size_t most);
  std::uint64_t overwritten() const;
  void discard();  // discards all samples so far
  Nanoseconds next_sample() const;

 private:
  void catch_up();

  mutable std::mutex mutex_;
  Clock& clock_;
  shaker::sim::RigOptions options_;
  shaker::sim::VirtualRig rig_;
  Nanoseconds reached_, stride_;
  std::vector<shaker::sim::RigSample> scratch_, queue_;
  std::size_t first_ = 0, count_ = 0;
  std::uint64_t overwritten_ = 0;
};

}  // namespace shaker::drivers::sim
