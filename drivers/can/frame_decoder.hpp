// Converts frames to samples: assigns signals of messages to channels of the rig.
//
// Used by the CAN sensor and by the replay of a candump log. Pure; const after make(); decode()
// does not allocate.
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
  // An Error names a message or signal that the database does not have, and those that it has.
  static Result<FrameDecoder> make(protocol::can::Database database,
                                   std::span<const config::CanSignal> signals);

  struct Outcome {
    std::size_t samples = 0;
    bool malformed = false;                // a required signal lies partly outside the frame
    int message = -1;                      // index of the message among the required ones, from 0
    std::optional<std::uint64_t> counter;  // its signal named `counter`
  };
  // Precondition: out.size() >= most_samples(). Frames of other messages give no samples. A
  // value that is not finite, or outside the range in the database, has Quality::bad; so have
  // all values of a frame whose signal `error` is not zero.
  Outcome decode(const protocol::can::Frame& frame, Nanoseconds t, std::span<Sample> out) const;

  std::size_t messages() const { return groups_.size(); }
  // Number of frames missing between two counter values of one message; 0 after a restart of
  // the sensor (a step backwards).
  std::uint64_t frames_between(int message, std::uint64_t before, std::uint64_t after) const;

  std::size_t most_samples() const { return most_samples_; }  // of one frame
  std::size_t longest_message() const { return longest_; }    // bytes
  std::vector<protocol::Channel> channels() const;
  std::vector<Identifier> identifiers() const;
  // The shortest cycle time of the required messages; empty if the database states none.
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
