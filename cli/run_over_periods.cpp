#include "cli/run_over_periods.hpp"

#include <utility>

#include <fmt/format.h>

#include "estimator/signal/harmonic_curve.hpp"
#include "estimator/signal/phase_drift.hpp"

namespace shaker::cli {
namespace {

using estimator::RunData;

// The excitation repeats with every period, also where the response does not.
void put_excitation_over(const estimator::CycleExcitation& one, int periods, RunData& run) {
  run.periods = periods;
  run.frequency_hz = one.frequency_hz;
  run.amplitude = one.amplitude;
  run.excitation_error = one.error;
  for (int k = 0; k < periods; ++k)
    run.excitation.insert(run.excitation.end(), one.samples.begin(), one.samples.end());
}

// Checks that the groups begin in the same phase of the excitation along the whole record.
Result<void> check_phase(const CsvTable& table, const std::string& origin, double frequency_hz) {
  if (!table.columns.contains("excitation")) return {};
  const estimator::PhaseDrift drift =
      estimator::phase_drift(table.columns.at("t"), table.columns.at("excitation"), frequency_hz);
  if (!drift.spoils_cycles()) return {};
  return Error{
      ErrorKind::invalid,
      fmt::format("{}: the excitation drifts by {:.3f} of a period against {:g} Hz over the "
                  "record, so that cycles cut by that are not alike: its frequency is "
                  "{:.7g} Hz; give that with --frequency",
                  origin, drift.turns, frequency_hz, drift.frequency_hz)};
}

std::size_t begin_of_unbroken(const std::vector<record::CycleRow>& rows) {
  std::size_t first = rows.empty() ? 0 : rows.size() - 1;
  while (first > 0 && rows[first - 1].index + 1 == rows[first].index &&
         rows[first - 1].displacement.size() == rows.back().displacement.size() &&
         rows[first - 1].excitation.size() == rows.back().excitation.size())
    --first;
  return first;
}

}  // namespace

Cycles cycles_of(const CsvTable& table, double frequency_hz) {
  return estimator::cycles_of(table.columns.at("t"), stroke_of(table), frequency_hz);
}

Result<RunOverPeriods> run_over_periods(const CsvTable& table, const std::string& origin,
                                        const Dwell& dwell, int periods) {
  const auto found = run_from_table(table, origin, dwell);
  if (!found) return found.error();
  const Cycles cycles = cycles_of(table, dwell.frequency_hz);
  if (cycles.points == 0)
    return Error{ErrorKind::invalid,
                 fmt::format("{}: fewer than {:.0f} samples in a period do not show a response "
                             "over {} of them",
                             origin, estimator::kMinSamplesForCubic, periods)};
  if (auto good = check_phase(table, origin, dwell.frequency_hz); !good) return good.error();
  if (auto good = check_repetition(cycles, periods, origin); !good) return good.error();
  RunOverPeriods out;
  put_excitation_over(
      {found->frequency_hz, found->amplitude, found->excitation, found->excitation_error}, periods,
      out.data);
  out.cycles = static_cast<long>(cycles.count()) / periods * periods;
  auto mean = estimator::mean_of_groups(table.columns.at("t"), stroke_of(table), dwell.frequency_hz,
                                        cycles, periods);
  if (mean.group.mean.empty())
    return Error{ErrorKind::invalid,
                 fmt::format("{}: its samples show {:.1f} harmonics of the excitation; at least {} "
                             "are needed for a response over {} periods: sample faster",
                             origin, mean.harmonics, estimator::kMinHarmonicsOfGroup, periods)};
  put_mean_cycle(std::move(mean.group), out.data);
  return out;
}

Cycles last_unbroken_cycles(const std::vector<record::CycleRow>& rows) {
  Cycles out;
  if (rows.empty()) return out;
  out.points = rows.back().displacement.size();
  for (std::size_t r = begin_of_unbroken(rows); r < rows.size(); ++r)
    out.y.insert(out.y.end(), rows[r].displacement.begin(), rows[r].displacement.end());
  return out;
}

Result<RunOverPeriods> run_over_periods(const std::vector<record::CycleRow>& rows,
                                        const std::string& place, const std::string& name,
                                        int periods) {
  const Cycles cycles = estimator::steady_groups(last_unbroken_cycles(rows), periods);
  if (auto good = check_repetition(cycles, periods, place, name); !good) return good.error();
  RunOverPeriods out;
  out.cycles = static_cast<long>(cycles.count());
  put_excitation_over(mean_excitation_of({rows.end() - out.cycles, rows.end()}), periods, out.data);
  put_mean_cycle(estimator::mean_cycle(cycles.y, cycles.points * static_cast<std::size_t>(periods)),
                 out.data);
  return out;
}

}  // namespace shaker::cli
