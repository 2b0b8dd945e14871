#include "drivers/can/receiver.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "protocol/can/error_frame.hpp"

namespace shaker::drivers::can {
namespace {

constexpr std::size_t kSentenceRoom = 512;
constexpr Nanoseconds kShortestSilence = std::chrono::milliseconds(100);
constexpr Nanoseconds kUnstatedSilence = std::chrono::seconds(1);
constexpr Nanoseconds kTroubleShown = std::chrono::seconds(2);

}  // namespace

Receiver::Receiver(FrameDecoder decoder, std::string interface,
                   std::optional<config::CanOpen> canopen)
    : decoder_(std::move(decoder)), interface_(std::move(interface)) {
  if (canopen) canopen_.emplace(*canopen);
  counters_.resize(decoder_.messages());
  sentence_.reserve(kSentenceRoom);
  health_.trouble.reserve(kSentenceRoom);
  const auto period = decoder_.expected_period();
  silence_limit_ = period ? std::max(kShortestSilence, 5 * *period) : kUnstatedSilence;
  silence_sentence_ = fmt::format(
      "{}: the sensor has been silent for {:.1f} s{}: check that it is powered, started and at the "
      "bus's bit rate",
      interface_, seconds(silence_limit_),
      period ? fmt::format(", its messages are due every {:g} ms", seconds(*period) * 1e3) : "");
}

void Receiver::connected(Nanoseconds now) {
  if (connected_before_) ++health_.reconnects;
  connected_before_ = true;
  health_.link_up = true;
  health_.trouble.clear();
  sampled_ = now;
  silent_ = false;
  unexplained_ = 0;
  counters_.assign(decoder_.messages(), std::nullopt);
  if (canopen_) canopen_->restart(now);
}

void Receiver::count_dropped(std::uint64_t frames) {
  health_.lost += frames;
  unexplained_ += frames;
}

void Receiver::look_at_silence(Nanoseconds now) {
  if (silent_ || now - sampled_ <= silence_limit_) return;
  silent_ = true;
  ++health_.errors;
  trouble(silence_sentence_, now);
}

void Receiver::disconnected(const std::string& sentence) {
  ++health_.errors;
  health_.link_up = false;
  health_.trouble = sentence;
}

void Receiver::trouble(std::string_view sentence, Nanoseconds now) {
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
  health_.link_up = true;  // a frame arrived, so it is not bus-off
  if (canopen_) take_canopen(frame, t, block);
  const auto fresh = block.out.subspan(block.count);
  const auto outcome = decoder_.decode(frame, t, fresh);
  if (outcome.malformed) ++health_.malformed;
  if (outcome.counter) {
    auto& last = counters_[static_cast<std::size_t>(outcome.message)];
    const auto gap = last ? decoder_.frames_between(outcome.message, *last, *outcome.counter) : 0;
    const auto known = std::min(gap, unexplained_);
    unexplained_ -= known;
    health_.lost += gap - known;
    last = outcome.counter;
  }
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
  sampled_ = t;
  silent_ = false;
  if (t - trouble_at_ > kTroubleShown) health_.trouble.clear();
}

}  // namespace shaker::drivers::can
