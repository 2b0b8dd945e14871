// Source of the samples of a replay. One thread. Does not allocate after rewind(), except on an
// error.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/result.hpp"
#include "drivers/sensor.hpp"

namespace shaker::drivers::replay {

class Source {
 public:
  virtual ~Source() = default;
  virtual std::vector<protocol::Channel> channels() const = 0;
  // Returns to the first sample and resets the counters.
  virtual Result<void> rewind() = 0;
  // Writes the samples of the next recorded time, with their recorded stamps; returns 0 at the
  // end. Precondition: out.size() >= most_samples().
  virtual std::size_t next(std::span<Sample> out) = 0;
  virtual std::size_t most_samples() const = 0;
  virtual const SensorHealth& health() const = 0;
};

}  // namespace shaker::drivers::replay
