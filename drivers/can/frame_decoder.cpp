#include "drivers/can/frame_decoder.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "base/unit.hpp"

namespace shaker::drivers::can {
namespace {

template <class List>
std::string names(const List& list) {
  std::string text;
  for (const auto& item : list)
    text += (text.empty() ? "" : ", ") + item.name;
  return text.empty() ? "none" : text;
}

std::optional<std::size_t> index_of(const protocol::can::Message& message, std::string_view name) {
  const auto* signal = message.find(name);
  if (signal == nullptr || signal->multiplexed) return std::nullopt;
  return static_cast<std::size_t>(signal - message.signals.data());
}

// Sets scale and offset from the unit in the database, unless the rig file gives them.
Result<void> convert(config::CanSignal& asked, const protocol::can::Signal& signal,
                     const std::string& origin) {
  const std::string wanted(asked.unit.empty() ? protocol::unit(asked.channel) : asked.unit);
  if (asked.scale || asked.offset || wanted.empty() || signal.unit.empty()) return {};
  const auto found = conversion(signal.unit, wanted);
  if (!found) {
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: signal {} of message {} is in \"{}\", which cannot be converted into "
                    "{}; known are {}. For another one, give the signal a scale in the rig "
                    "file that leads to {}",
                    origin, asked.signal, asked.message, signal.unit, wanted, units_like(wanted),
                    wanted)};
  }
  asked.scale = found->scale;
  asked.offset = found->offset;
  return {};
}

}  // namespace

Result<FrameDecoder> FrameDecoder::make(protocol::can::Database database,
                                        std::span<const config::CanSignal> signals) {
  FrameDecoder decoder;
  if (signals.empty()) {
    return Error{ErrorKind::invalid,
                 "the CAN sensor has no signals; list at least one under 'signals'"};
  }
  for (config::CanSignal asked : signals) {
    const auto* message = database.find(asked.message);
    if (message == nullptr) {
      return Error{ErrorKind::invalid,
                   fmt::format("{} has no message '{}'; it has: {}", database.origin, asked.message,
                               names(database.messages))};
    }
    const auto* signal = message->find(asked.signal);
    if (signal == nullptr) {
      return Error{ErrorKind::invalid,
                   fmt::format("{}: message {} has no signal '{}'; it has: {}", database.origin,
                               message->name, asked.signal, names(message->signals))};
    }
    if (message->size > protocol::can::kMaxLength) {
      return Error{
          ErrorKind::invalid,
          fmt::format("{}: message {} has {} bytes, a frame holds at most {}", database.origin,
                      message->name, message->size, protocol::can::kMaxLength)};
    }
    if (auto good = convert(asked, *signal, database.origin); !good) return good.error();
    const auto index = static_cast<std::size_t>(message - database.messages.data());
    auto group = std::ranges::find(decoder.groups_, index, &Group::message);
    if (group == decoder.groups_.end()) {
      group = decoder.groups_.insert(
          group, Group{index, {}, index_of(*message, "counter"), index_of(*message, "error")});
    }
    group->wanted.push_back({static_cast<std::size_t>(signal - message->signals.data()),
                             asked.channel, asked.scale.value_or(1.0), asked.offset.value_or(0.0)});
    decoder.most_samples_ = std::max(decoder.most_samples_, group->wanted.size());
    decoder.longest_ = std::max(decoder.longest_, message->size);
  }
  decoder.database_ = std::move(database);
  return decoder;
}

FrameDecoder::Outcome FrameDecoder::decode(const protocol::can::Frame& frame, Nanoseconds t,
                                           std::span<Sample> out) const {
  Outcome outcome;
  if (frame.error || frame.remote) return outcome;
  for (const Group& group : groups_) {
    const auto& message = database_.messages[group.message];
    if (message.id != frame.id || message.extended != frame.extended) continue;
    for (const Wanted& wanted : group.wanted) {
      const auto& signal = message.signals[wanted.signal];
      const auto decoded = protocol::can::decode(message, signal, frame.bytes());
      if (decoded.presence == protocol::can::Presence::malformed) outcome.malformed = true;
      if (decoded.presence != protocol::can::Presence::present) continue;
      Sample sample{t, decoded.value * wanted.scale + wanted.offset, wanted.channel, Quality::good};
      if (!std::isfinite(sample.value) || !protocol::can::in_range(signal, decoded.value)) {
        sample.quality = Quality::bad;
      }
      out[outcome.samples++] = sample;
    }
    outcome.message = static_cast<int>(&group - groups_.data());
    if (group.counter) {
      outcome.counter = protocol::can::raw_bits(message.signals[*group.counter], frame.bytes());
    }
    if (group.error &&
        protocol::can::raw_bits(message.signals[*group.error], frame.bytes()).value_or(0) != 0) {
      for (Sample& sample : out.first(outcome.samples))
        sample.quality = Quality::bad;
    }
    break;  // a database has each identifier once
  }
  return outcome;
}

std::uint64_t FrameDecoder::frames_between(int message, std::uint64_t before,
                                           std::uint64_t after) const {
  const Group& group = groups_[static_cast<std::size_t>(message)];
  if (!group.counter) return 0;
  const int bits = database_.messages[group.message].signals[*group.counter].length;
  const std::uint64_t step = (after - before) << (64 - bits) >> (64 - bits);
  const bool forwards = step != 0 && step >> (bits - 1) == 0;
  return forwards ? step - 1 : 0;
}

std::vector<protocol::Channel> FrameDecoder::channels() const {
  std::vector<protocol::Channel> all;
  for (const Group& group : groups_) {
    for (const Wanted& wanted : group.wanted) {
      if (std::ranges::find(all, wanted.channel) == all.end()) all.push_back(wanted.channel);
    }
  }
  return all;
}

std::vector<Identifier> FrameDecoder::identifiers() const {
  std::vector<Identifier> all;
  for (const Group& group : groups_) {
    const auto& message = database_.messages[group.message];
    all.push_back({message.id, message.extended});
  }
  return all;
}

std::optional<Nanoseconds> FrameDecoder::expected_period() const {
  std::optional<Nanoseconds> shortest;
  for (const Group& group : groups_) {
    const auto& cycle = database_.messages[group.message].cycle_time_s;
    if (cycle && (!shortest || from_seconds(*cycle) < *shortest)) shortest = from_seconds(*cycle);
  }
  return shortest;
}

}  // namespace shaker::drivers::can
