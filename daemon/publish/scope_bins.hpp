// The smallest and the largest sample of each channel in bins of 20 ms, for people who look on.
//
// One thread. Leaves out samples that are bad or not finite, and those that come after a sample
// of a later bin of their channel.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "base/clock.hpp"
#include "drivers/sensor.hpp"
#include "protocol/documents.hpp"

namespace shaker::daemon {

class ScopeBins {
 public:
  static constexpr Nanoseconds kBin = std::chrono::milliseconds(20);
  static constexpr Nanoseconds kPeriod = std::chrono::milliseconds(100);
  static constexpr std::size_t kMaxBins = 50;  // of a channel in one document; later ones are lost

  void add(std::span<const drivers::Sample> samples);
  // The bins that were completed since the last document, ten times a second; nothing if there
  // are none.
  std::optional<protocol::ScopeDocument> take(Nanoseconds now);
  void clear();

 private:
  struct Channel {
    std::optional<std::int64_t> open;  // the bin that is being filled
    double smallest = 0.0, largest = 0.0;
    protocol::ScopeChannel done;
  };
  static void close(Channel& channel);

  std::array<Channel, protocol::kChannelCount> channels_;
  Nanoseconds next_{};
};

}  // namespace shaker::daemon
