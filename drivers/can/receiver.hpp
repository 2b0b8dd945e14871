// Processes the frames of the CAN sensor, without its socket: samples, error frames, CANopen,
// health.
//
// Separate from the socket, so that tests can supply frames. One thread. `take` does not
// allocate.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/can/canopen.hpp"
#include "drivers/can/frame_decoder.hpp"
#include "drivers/sensor.hpp"

namespace shaker::drivers::can {

// The samples of one read(), filled from the front.
struct Block {
  std::span<Sample> out;
  std::size_t count = 0;
  std::size_t room() const { return out.size() - count; }
};

class Receiver {
 public:
  Receiver(FrameDecoder decoder, std::string interface, std::optional<config::CanOpen> canopen);

  // The link has come up (again): CANopen restarts.
  void connected(Nanoseconds now);
  // The link is lost; `sentence` is the reason.
  void disconnected(const std::string& sentence);
  // Precondition: block.room() >= decoder().most_samples(). If the node has booted during a
  // run, the samples in the block are removed and counted as lost.
  void take(const protocol::can::Frame& frame, Nanoseconds t, Block& block);

  // Call after each read(). Reports once that the sensor has been silent for five of its stated
  // periods (at least 0.1 s; 1 s if the DBC file states none).
  void look_at_silence(Nanoseconds now);

  // Shows the sentence until a good sample arrives two seconds later.
  void trouble(std::string_view sentence, Nanoseconds now);
  // The kernel has dropped `frames`. Call before the following frames are taken, so that the
  // gap in a counter is not counted again.
  void count_dropped(std::uint64_t frames);
  void count_error() { ++health_.errors; }
  void count_malformed() { ++health_.malformed; }

  const SensorHealth& health() const { return health_; }
  const FrameDecoder& decoder() const { return decoder_; }
  CanopenNode* canopen() { return canopen_ ? &*canopen_ : nullptr; }

 private:
  void take_error(const protocol::can::Frame& frame, Nanoseconds t);
  void take_canopen(const protocol::can::Frame& frame, Nanoseconds t, Block& block);

  FrameDecoder decoder_;
  std::string interface_;
  std::optional<CanopenNode> canopen_;
  SensorHealth health_;
  std::vector<std::optional<std::uint64_t>> counters_;  // last value for each message
  std::string sentence_;                                // scratch memory
  Nanoseconds trouble_at_{};                            // time of health_.trouble
  std::uint64_t unexplained_ = 0;  // dropped frames that no counter has shown yet
  Nanoseconds sampled_{};          // time of the last sample, or of the connection
  Nanoseconds silence_limit_{};
  std::string silence_sentence_;
  bool connected_before_ = false;
  bool silent_ = false;
};

}  // namespace shaker::drivers::can
