// Channels of a stretch of a run side by side, on the times of one of them.
#pragma once

#include <span>
#include <vector>

#include "record/campaign_database.hpp"

namespace shaker::record {

struct ChannelColumns {
  std::vector<double> t;                    // s, increasing, from 0 on
  std::vector<std::vector<double>> values;  // one column a channel, in the channel's own unit
};

// On the times of the first of `channels`, as far as every one of them was sampled; the others by
// polynomials of fifth degree between their samples, and as they are where their times are the
// same. `samples` are of one run, in the order of their arrival. Empty when a channel has fewer
// than 16 of them.
ChannelColumns channel_columns(std::span<const SampleRow> samples,
                               std::span<const protocol::Channel> channels);

}  // namespace shaker::record
