// What the CAN sensor does with each frame, without its socket: samples, error frames, CANopen,
// health.
//
// Apart from the socket so that tests feed it frames by hand. One thread. `take` does not allocate.
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

  // A link has come up (again): CANopen starts over.
  void connected(Nanoseconds now);
  // The link is gone, for this reason.
  void disconnected(const std::string& sentence);
  // Precondition: block.room() >= decoder().most_samples(). Frames of a node that just booted in
  // mid-run empty the block: those samples are counted as lost.
  void take(const protocol::can::Frame& frame, Nanoseconds t, Block& block);

  // To be called when nothing came: says so once when the sensor is silent for five of its stated
  // periods (0.1 s at least; 1 s when the DBC file states none).
  void look_at_silence(Nanoseconds now);

  // Shows the sentence until two seconds later a good sample comes.
  void trouble(std::string_view sentence, Nanoseconds now);
  // The kernel dropped so many, to be called before the frames behind them are taken: the gap that
  // they leave in a counter is not counted again.
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
  std::vector<std::optional<std::uint64_t>> counters_;  // the last of each wanted message
  std::string sentence_;                                // scratch with room
  Nanoseconds trouble_at_{};                            // of health_.trouble
  std::uint64_t unexplained_ = 0;  // dropped frames that no counter has shown yet
  Nanoseconds sampled_{};          // last sample, or the connection
  Nanoseconds silence_limit_{};
  std::string silence_sentence_;
  bool connected_before_ = false;
  bool silent_ = false;
};

}  // namespace shaker::drivers::can
