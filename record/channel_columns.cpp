#include "record/channel_columns.hpp"

#include <algorithm>
#include <cstdint>

namespace shaker::record {
namespace {

constexpr std::size_t kFewest = 16;  // samples that a channel needs
constexpr std::size_t kAround = 6;   // samples around a time, for the interpolation

struct Raw {
  std::vector<double> t, value;

  // Value of the polynomial through the samples around `when`. Linear interpolation would
  // reduce a fundamental of 60 samples a period by 0.1 %, more than the noise of most channels.
  double at(double when) const {
    const auto next = static_cast<std::size_t>(std::ranges::lower_bound(t, when) - t.begin());
    if (next < t.size() && t[next] == when) return value[next];
    const std::size_t half = kAround / 2;
    const std::size_t begin = std::min(next < half ? 0 : next - half, t.size() - kAround);
    double sum = 0.0;
    for (std::size_t i = begin; i < begin + kAround; ++i) {
      double weight = 1.0;
      for (std::size_t j = begin; j < begin + kAround; ++j) {
        if (j != i) weight *= (when - t[j]) / (t[i] - t[j]);
      }
      sum += weight * value[i];
    }
    return sum;
  }
};

Raw pick(std::span<const SampleRow> samples, protocol::Channel channel) {
  Raw raw;
  for (const SampleRow& sample : samples) {
    if (sample.channel != channel) continue;
    const double t = seconds_between(samples.front(), sample);
    if (!raw.t.empty() && t <= raw.t.back()) continue;
    raw.t.push_back(t);
    raw.value.push_back(sample.value);
  }
  return raw;
}

}  // namespace

ChannelColumns channel_columns(std::span<const SampleRow> samples,
                               std::span<const protocol::Channel> channels) {
  if (samples.empty() || channels.empty()) return {};
  std::vector<Raw> raw;
  for (const protocol::Channel channel : channels) {
    raw.push_back(pick(samples, channel));
    if (raw.back().t.size() < kFewest) return {};
  }
  ChannelColumns out;
  for (const double t : raw.front().t) {
    if (std::ranges::all_of(raw, [t](const Raw& r) { return r.t.front() <= t && t <= r.t.back(); }))
      out.t.push_back(t);
  }
  for (const Raw& each : raw) {
    std::vector<double>& column = out.values.emplace_back();
    column.reserve(out.t.size());
    for (const double t : out.t)
      column.push_back(each.at(t));
  }
  if (!out.t.empty()) {
    const double begin = out.t.front();
    for (double& t : out.t)
      t -= begin;
  }
  return out;
}

}  // namespace shaker::record
