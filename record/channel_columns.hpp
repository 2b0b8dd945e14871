// Puts channels of a part of a run side by side, at the sample times of one of them.
#pragma once

#include <span>
#include <vector>

#include "record/campaign_database.hpp"

namespace shaker::record {

struct ChannelColumns {
  std::vector<double> t;                    // s, increasing, from 0 on
  std::vector<std::vector<double>> values;  // one column for each channel, in its own unit
};

// Uses the times of the first of `channels` within the range in which all were sampled. The
// others are interpolated by polynomials of fifth degree; equal times give the sample itself.
// `samples` belong to one run, in order of arrival. The result is empty if a channel has fewer
// than 16 samples.
ChannelColumns channel_columns(std::span<const SampleRow> samples,
                               std::span<const protocol::Channel> channels);

}  // namespace shaker::record
