// Port: a source of samples (displacement, and excitation where it is measured).
//
// One owner, one thread. A driver stamps with the best clock there is, decodes through protocol/
// and returns; it keeps nothing for later. In real time the daemon's acquisition thread calls
// `read` in a loop; in simulated time the engine calls it after advancing the clock.
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

// Which clock stamped the samples; published with every estimate.
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

// Counters since connect; all only grow.
struct SensorHealth {
  std::uint64_t samples = 0;
  std::uint64_t lost = 0;       // receive-queue overflow, gaps in counters
  std::uint64_t malformed = 0;  // frames that do not decode
  std::uint64_t errors = 0;     // error frames, timeouts, exceptions
  std::uint64_t reconnects = 0;
  bool link_up = false;
  std::string trouble;  // last sentence for the operator; empty when all is well
};

class Sensor {
 public:
  virtual ~Sensor() = default;
  virtual std::string description() const = 0;
  virtual std::vector<protocol::Channel> channels() const = 0;
  virtual StampSource stamp_source() const = 0;

  // Opens or re-opens the device. May be called again after an Error from read().
  virtual Result<void> connect() = 0;
  // Waits at most `timeout` for samples and writes them, in time order per channel, to the front of
  // `out`; returns how many. 0 is no error. Does not allocate after connect(). An Error means that
  // the link is gone; the caller backs off and calls connect().
  virtual Result<std::size_t> read(std::span<Sample> out, Nanoseconds timeout) = 0;
  virtual SensorHealth health() const = 0;
  // True once a finite source (a replay) has given its last sample.
  virtual bool finished() const { return false; }
};

}  // namespace shaker::drivers
