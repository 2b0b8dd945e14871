// Where a replay's samples come from. One thread. Nothing allocates after rewind().
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
  // Back to the first sample; counters start over.
  virtual Result<void> rewind() = 0;
  // The samples of the next recorded moment, with its time as recorded; 0 at the end.
  // Precondition: out.size() >= most_samples().
  virtual std::size_t next(std::span<Sample> out) = 0;
  virtual std::size_t most_samples() const = 0;
  virtual const SensorHealth& health() const = 0;
};

}  // namespace shaker::drivers::replay
