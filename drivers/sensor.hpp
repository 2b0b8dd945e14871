// Port: a source of samples (displacement, and excitation if it is measured).
//
// One owner, one thread. A driver stamps samples with the best clock available, decodes them
// through protocol/ and returns them; it keeps none for later. In real time the daemon's
// acquisition thread calls `read` in a loop; in simulated time the engine calls it after it has
// advanced the clock.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "protocol/channel.hpp"

namespace shaker::drivers {

enum class Quality : std::uint8_t {
  good,
  suspect,  // the device flags it, or it is a repeat
  bad       // not finite, out of the sensor's range, error status
};

struct Sample {
  Nanoseconds t{};     // CLOCK_MONOTONIC domain of the daemon's Clock
  double value = 0.0;  // SI, see protocol::Channel
  protocol::Channel channel = protocol::Channel::displacement;
  Quality quality = Quality::good;
};

// The clock that stamped the samples; published with every estimate.
enum class StampSource {
  host_receive,
  kernel_receive,
  adapter_hardware,
  device,
  simulated,
  recorded
};
constexpr std::string_view name(StampSource s) {
  constexpr std::string_view names[] = {"host_receive", "kernel_receive", "adapter_hardware",
                                        "device",       "simulated",      "recorded"};
  return names[static_cast<int>(s)];
}

// State of a sensor. The counters grow for the life of the sensor; connect() keeps them, except
// in a replay.
struct SensorHealth {
  std::uint64_t samples = 0;
  std::uint64_t lost = 0;       // receive-queue overflow, gaps in counters
  std::uint64_t malformed = 0;  // frames that do not decode
  std::uint64_t errors = 0;     // error frames, timeouts, exceptions
  std::uint64_t reconnects = 0;
  bool link_up = false;
  std::string trouble;  // last message for the operator; empty: none
};

class Sensor {
 public:
  virtual ~Sensor() = default;
  virtual std::string description() const = 0;
  virtual std::vector<protocol::Channel> channels() const = 0;
  virtual StampSource stamp_source() const = 0;

  // Opens or re-opens the device. May be called again after an Error from read().
  virtual Result<void> connect() = 0;
  // Waits at most `timeout` for samples and writes them to the front of `out`, in time order
  // for each channel. Returns their number; 0 is not an error. Does not allocate after
  // connect() unless it fails. An Error means that the link is lost; the caller waits and calls
  // connect().
  virtual Result<std::size_t> read(std::span<Sample> out, Nanoseconds timeout) = 0;
  virtual SensorHealth health() const = 0;
  // True once a finite source (a replay) has delivered its last sample.
  virtual bool finished() const { return false; }
};

}  // namespace shaker::drivers
