#include "daemon/publish/scope_bins.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace shaker::daemon {

void ScopeBins::add(std::span<const drivers::Sample> samples) {
  for (const drivers::Sample& sample : samples) {
    if (sample.quality == drivers::Quality::bad || !std::isfinite(sample.value)) continue;
    Channel& channel = channels_[static_cast<std::size_t>(sample.channel)];
    const std::int64_t bin = sample.t / kBin;
    if (channel.open && bin < *channel.open) continue;
    if (channel.open == bin) {
      channel.smallest = std::min(channel.smallest, sample.value);
      channel.largest = std::max(channel.largest, sample.value);
      continue;
    }
    close(channel);
    channel.open = bin;
    channel.smallest = channel.largest = sample.value;
  }
}

void ScopeBins::close(Channel& channel) {
  if (!channel.open || channel.done.bin.size() >= kMaxBins) return;
  channel.done.bin.push_back(*channel.open);
  channel.done.smallest.push_back(channel.smallest);
  channel.done.largest.push_back(channel.largest);
}

std::optional<protocol::ScopeDocument> ScopeBins::take(Nanoseconds now) {
  if (now < next_) return std::nullopt;
  next_ = std::max(next_ + kPeriod, now);
  protocol::ScopeDocument document;
  document.bin_s = seconds(kBin);
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    protocol::ScopeChannel& done = channels_[i].done;
    if (done.bin.empty()) continue;
    done.channel = std::string(protocol::name(static_cast<protocol::Channel>(i)));
    document.channels.push_back(std::exchange(done, {}));
  }
  if (document.channels.empty()) return std::nullopt;
  return document;
}

void ScopeBins::clear() {
  channels_ = {};
}

}  // namespace shaker::daemon
