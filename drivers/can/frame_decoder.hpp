// From a frame to samples: which signals of which messages are which channel of the rig.
//
// Used by the CAN sensor and by the replay of a candump log. Pure; const after make(), does not
// allocate.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/sensor.hpp"
#include "protocol/can/database.hpp"
#include "protocol/can/frame.hpp"

namespace shaker::drivers::can {

struct Identifier {
  std::uint32_t id = 0;
  bool extended = false;
  bool operator==(const Identifier&) const = default;
};

class FrameDecoder {
 public:
  // An Error names the message or signal that the database does not have, and those that it has.
  static Result<FrameDecoder> make(protocol::can::Database database,
                                   std::span<const config::CanSignal> signals);

  struct Outcome {
    std::size_t samples = 0;
    bool malformed = false;                // a wanted signal is not wholly in the frame
    int message = -1;                      // which of the wanted messages, from 0
    std::optional<std::uint64_t> counter;  // its signal named `counter`
  };
  // Precondition: out.size() >= most_samples(). Frames of other messages give nothing. A value that
  // is not finite, or outside the range that the database states, has Quality::bad; so has all that
  // comes with a signal named `error` that is not zero.
  Outcome decode(const protocol::can::Frame& frame, Nanoseconds t, std::span<Sample> out) const;

  std::size_t messages() const { return groups_.size(); }
  // Frames missing between two counts of one message; 0 after a restart of the sensor (a step
  // backwards).
  std::uint64_t frames_between(int message, std::uint64_t before, std::uint64_t after) const;

  std::size_t most_samples() const { return most_samples_; }  // of one frame
  std::size_t longest_message() const { return longest_; }    // bytes
  std::vector<protocol::Channel> channels() const;
  std::vector<Identifier> identifiers() const;
  // The shortest stated cycle time of a wanted message; nothing when the database states none.
  std::optional<Nanoseconds> expected_period() const;

 private:
  struct Wanted {
    std::size_t signal;  // in its message
    protocol::Channel channel;
    double scale, offset;
  };
  struct Group {
    std::size_t message;  // in the database
    std::vector<Wanted> wanted;
    std::optional<std::size_t> counter, error;  // signals of these names
  };
  protocol::can::Database database_;
  std::vector<Group> groups_;
  std::size_t most_samples_ = 0;
  std::size_t longest_ = 0;
};

}  // namespace shaker::drivers::can
