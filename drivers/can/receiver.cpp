#include "drivers/can/receiver.hpp"

#include "protocol/can/error_frame.hpp"

namespace shaker::drivers::can {
namespace {

constexpr std::size_t kSentenceRoom = 512;
constexpr Nanoseconds kTroubleShown = std::chrono::seconds(2);

}  // namespace

Receiver::Receiver(FrameDecoder decoder, std::string interface,
                   std::optional<config::CanOpen> canopen)
    : decoder_(std::move(decoder)), interface_(std::move(interface)) {
  if (canopen) canopen_.emplace(*canopen);
  sentence_.reserve(kSentenceRoom);
  health_.trouble.reserve(kSentenceRoom);
}

void Receiver::connected(Nanoseconds now) {
  if (connected_before_) ++health_.reconnects;
  connected_before_ = true;
  health_.link_up = true;
  health_.trouble.clear();
  if (canopen_) canopen_->restart(now);
}

void Receiver::disconnected(const std::string& sentence) {
  ++health_.errors;
  health_.link_up = false;
  health_.trouble = sentence;
}

void Receiver::trouble(const std::string& sentence, Nanoseconds now) {
  health_.trouble.assign(sentence);
  trouble_at_ = now;
}

void Receiver::take_error(const protocol::can::Frame& frame, Nanoseconds t) {
  const auto report = protocol::can::interpret_error(frame);
  ++health_.errors;
  health_.lost += report.lost;
  if (report.bus_off) health_.link_up = false;
  if (report.restarted) health_.link_up = true;
  sentence_.clear();
  protocol::can::describe_error(frame, interface_, sentence_);
  trouble(sentence_, t);
}

void Receiver::take_canopen(const protocol::can::Frame& frame, Nanoseconds t, Block& block) {
  sentence_.clear();
  switch (canopen_->on_frame(frame, sentence_)) {
    case CanopenNode::Event::lost_power:
      health_.lost += block.count;
      block.count = 0;
      [[fallthrough]];
    case CanopenNode::Event::emergency:
    case CanopenNode::Event::not_operational:
      ++health_.errors;
      trouble(sentence_, t);
      break;
    case CanopenNode::Event::none:
    case CanopenNode::Event::booted:
    case CanopenNode::Event::emergency_over:
      break;
  }
}

void Receiver::take(const protocol::can::Frame& frame, Nanoseconds t, Block& block) {
  if (frame.error) return take_error(frame, t);
  health_.link_up = true;  // a frame got through: no longer bus-off
  if (canopen_) take_canopen(frame, t, block);
  const auto fresh = block.out.subspan(block.count);
  const auto outcome = decoder_.decode(frame, t, fresh);
  if (outcome.malformed) ++health_.malformed;
  if (outcome.samples == 0) return;
  if (canopen_) {
    canopen_->measured();
    for (Sample& sample : fresh.first(outcome.samples)) {
      if (canopen_->emergency() && sample.quality == Quality::good)
        sample.quality = Quality::suspect;
    }
  }
  block.count += outcome.samples;
  health_.samples += outcome.samples;
  if (t - trouble_at_ > kTroubleShown) health_.trouble.clear();
}

}  // namespace shaker::drivers::can
