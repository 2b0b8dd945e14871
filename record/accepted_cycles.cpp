#include "record/accepted_cycles.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "record/channel_columns.hpp"

namespace shaker::record {
namespace {

void append(AcceptedCycles& run, const CycleRow& cycle, double turn) {
  const std::size_t n = cycle.displacement.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double tau = static_cast<double>(i) / static_cast<double>(n);
    run.t.push_back((turn + tau) / run.frequency_hz);
    run.displacement.push_back(cycle.displacement[i]);
    if (cycle.excitation.size() == n)
      run.excitation.push_back(cycle.excitation[i]);
    else if (cycle.excitation.empty())
      run.excitation.push_back(cycle.amplitude * std::cos(2.0 * std::numbers::pi * tau));
  }
}

AcceptedCycles joined(const RunRow& row, std::vector<CycleRow> cycles) {
  std::erase_if(cycles, [](const CycleRow& cycle) { return !cycle.accepted; });
  AcceptedCycles run;
  run.name = row.name;
  if (cycles.empty()) return run;
  const auto count = static_cast<double>(cycles.size());
  for (const CycleRow& cycle : cycles) {
    run.frequency_hz += cycle.frequency_hz / count;
    run.amplitude += cycle.amplitude / count;
  }
  double turn = 0.0;
  for (const CycleRow& cycle : cycles)
    append(run, cycle, turn++);
  return run;
}

// If the run has a channel besides displacement and excitation, replaces its columns by raw
// samples over as many periods as it has accepted cycles; otherwise changes nothing.
Result<void> with_channels(const CampaignReader& reader, int index, double cycles,
                           AcceptedCycles& run) {
  using protocol::Channel;
  // Examines the last samples first, because most campaigns have no such channel.
  for (const double span : {0.0, cycles / run.frequency_hz}) {
    const auto samples = reader.last_samples(index, span);
    if (!samples) return samples.error();
    const auto has = [&](Channel channel) {
      return std::ranges::find(*samples, channel, &SampleRow::channel) != samples->end();
    };
    std::vector<Channel> wanted = {Channel::displacement, Channel::excitation};
    if (has(Channel::acceleration)) wanted.push_back(Channel::acceleration);
    if (has(Channel::force)) wanted.push_back(Channel::force);
    if (wanted.size() == 2 || !has(Channel::excitation)) return {};
    if (span == 0.0) continue;
    ChannelColumns columns = channel_columns(*samples, wanted);
    if (columns.t.empty()) return {};
    run.t = std::move(columns.t);
    run.displacement = std::move(columns.values[0]);
    run.excitation = std::move(columns.values[1]);
    for (std::size_t k = 2; k < wanted.size(); ++k) {
      auto& column = wanted[k] == Channel::force ? run.force : run.acceleration;
      column = std::move(columns.values[k]);
    }
  }
  return {};
}

}  // namespace

Result<std::vector<AcceptedCycles>> accepted_cycles(const CampaignReader& reader) {
  const auto rows = reader.runs();
  if (!rows) return rows.error();
  std::vector<AcceptedCycles> runs;
  for (const RunRow& row : *rows) {
    auto cycles = reader.cycles(row.index);
    if (!cycles) return cycles.error();
    const auto accepted = std::ranges::count(*cycles, true, &CycleRow::accepted);
    runs.push_back(joined(row, std::move(*cycles)));
    if (accepted == 0) continue;
    const auto added = with_channels(reader, row.index, static_cast<double>(accepted), runs.back());
    if (!added) return added.error();
  }
  return runs;
}

}  // namespace shaker::record
