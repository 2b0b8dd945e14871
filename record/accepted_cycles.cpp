#include "record/accepted_cycles.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

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

}  // namespace

Result<std::vector<AcceptedCycles>> accepted_cycles(const CampaignReader& reader) {
  const auto rows = reader.runs();
  if (!rows) return rows.error();
  std::vector<AcceptedCycles> runs;
  for (const RunRow& row : *rows) {
    auto cycles = reader.cycles(row.index);
    if (!cycles) return cycles.error();
    runs.push_back(joined(row, std::move(*cycles)));
  }
  return runs;
}

}  // namespace shaker::record
