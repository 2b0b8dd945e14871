#include "drivers/sim/simulated_rig.hpp"

#include <algorithm>

namespace shaker::drivers::sim {
namespace {

constexpr std::size_t kStride = 1024;  // samples of one step

}  // namespace

SimulatedRig::SimulatedRig(const shaker::sim::RigOptions& options, Clock& clock)
    : clock_(clock),
      options_(options),
      rig_(options, clock.now()),
      reached_(clock.now()),
      stride_(from_seconds(kStride / options.sample_rate_hz)) {
  scratch_.reserve(kStride + 8 + kStride / 8);  // the rig's clock may be up to a tenth faster
  queue_.resize(kQueue);
}

// Advances in steps, so that the scratch memory never grows, however far the clock has jumped.
void SimulatedRig::catch_up() {
  const Nanoseconds now = clock_.now();
  while (reached_ < now) {
    reached_ = std::min(now, reached_ + stride_);
    scratch_.clear();
    rig_.advance(reached_, scratch_);
    for (const auto& sample : scratch_) {
      queue_[(first_ + count_) % kQueue] = sample;
      if (count_ < kQueue) {
        ++count_;
      } else {
        first_ = (first_ + 1) % kQueue;
        ++overwritten_;
      }
    }
  }
}

std::size_t SimulatedRig::take(std::vector<shaker::sim::RigSample>& out, std::size_t most) {
  const std::scoped_lock lock(mutex_);
  catch_up();
  out.clear();
  for (; count_ > 0 && out.size() < most; --count_) {
    out.push_back(queue_[first_]);
    first_ = (first_ + 1) % kQueue;
  }
  return out.size();
}

std::uint64_t SimulatedRig::overwritten() const {
  const std::scoped_lock lock(mutex_);
  return overwritten_;
}

void SimulatedRig::discard() {
  const std::scoped_lock lock(mutex_);
  catch_up();
  count_ = 0;
}

Nanoseconds SimulatedRig::next_sample() const {
  const std::scoped_lock lock(mutex_);
  return rig_.next_sample();
}

}  // namespace shaker::drivers::sim
