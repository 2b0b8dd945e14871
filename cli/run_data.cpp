#include "cli/run_data.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "cli/campaign_place.hpp"
#include "cli/model_units.hpp"
#include "cli/run_over_periods.hpp"
#include "estimator/fit/harmonic_data.hpp"
#include "estimator/signal/harmonic_curve.hpp"
#include "record/campaign_database.hpp"

namespace shaker::cli {
namespace {

using estimator::RunData;

constexpr std::size_t kMinPoints = 8;
constexpr int kHarmonics = 8;

// The number of points in a period when the samples fill whole periods on equal steps;
// otherwise 0.
std::size_t points_of_even_grid(const std::vector<double>& t, double frequency) {
  const std::size_t n = estimator::points_of_equal_steps(t, frequency);
  return n > 0 && t.size() % n == 0 ? n : 0;
}

void put_excitation(estimator::CycleExcitation excitation, RunData& run) {
  run.frequency_hz = excitation.frequency_hz;
  run.amplitude = excitation.amplitude;
  run.excitation = std::move(excitation.samples);
  run.excitation_error = excitation.error;
}

Result<void> check(const std::vector<double>& t, const std::string& origin, const Dwell& dwell,
                   bool excitation_measured) {
  const auto bad = [&](const std::string& why) {
    return Error{ErrorKind::invalid, fmt::format("{}: {}", origin, why)};
  };
  if (!(dwell.frequency_hz > 0.0) || !std::isfinite(dwell.frequency_hz)) {
    return bad(fmt::format("the frequency is {} Hz; give one above 0 with --frequency",
                           dwell.frequency_hz));
  }
  if (!excitation_measured && (!dwell.amplitude || !(*dwell.amplitude > 0.0))) {
    return bad(
        "there is no excitation column, so the amplitude of the table's acceleration is "
        "wanted: give one above 0 with --amplitude");
  }
  if (t.size() < kMinPoints) {
    return bad(fmt::format("{} points; at least {} are needed", t.size(), kMinPoints));
  }
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (t[i] > t[i - 1]) continue;
    return bad(fmt::format("time does not increase: t = {:.9g} is followed by {:.9g} (point {})",
                           t[i - 1], t[i], i + 1));
  }
  const double periods = (t.back() - t.front()) * static_cast<double>(t.size()) /
                         static_cast<double>(t.size() - 1) * dwell.frequency_hz;
  if (periods < 0.9) {
    return bad(fmt::format("{:.2f} of a period at {} Hz; at least a whole one is needed", periods,
                           dwell.frequency_hz));
  }
  if (static_cast<double>(t.size()) / periods < 4.0) {
    return bad(
        fmt::format("{:.1f} points a period at {} Hz; at least 4 are needed: check "
                    "--frequency, and that t is in seconds",
                    static_cast<double>(t.size()) / periods, dwell.frequency_hz));
  }
  return {};
}

Result<void> check_names(const PeriodsOfRuns& periods, const std::vector<record::RunRow>& runs,
                         const std::string& file) {
  for (const auto& [name, count] : periods.named) {
    const auto same = [&name = name](const record::RunRow& row) { return row.name == name; };
    if (std::none_of(runs.begin(), runs.end(), same))
      return Error{ErrorKind::invalid,
                   fmt::format("{}: --periods names a run \"{}\" that there is not", file, name)};
  }
  return {};
}

// Checks a run for repetition. A run without an accepted cycle is checked too, because the
// daemon accepts no cycle of a response that repeats only after several periods.
void doubt_run(const std::vector<record::CycleRow>& cycles, const std::string& name, bool accepted,
               CampaignData& data) {
  constexpr std::size_t kLast = 24;  // the last cycles are settled when others are not
  Cycles last = last_unbroken_cycles(cycles);
  if (last.count() > kLast)
    last.y.erase(last.y.begin(), last.y.end() - static_cast<std::ptrdiff_t>(kLast * last.points));
  const std::string place =
      "run " + name + (accepted ? "" : ", of which no cycle was accepted and none is used");
  auto doubt = doubt_of_repetition(last, place, name);
  if (doubt.sentence.empty()) return;
  data.warnings.push_back(std::move(doubt.sentence));
  data.spoiled = data.spoiled || (doubt.spoils && accepted);
}

Result<void> add_accepted(const std::vector<record::CycleRow>& cycles, const std::string& place,
                          bool harmonics, CampaignData& data) {
  const record::CycleRow& first = cycles.front();
  for (const record::CycleRow& cycle : cycles) {
    if (cycle.displacement.size() != first.displacement.size() ||
        cycle.excitation.size() != first.excitation.size()) {
      return Error{ErrorKind::invalid,
                   fmt::format("{}: cycle {} has {} points, cycle {} has {}", place, cycle.index,
                               cycle.displacement.size(), first.index, first.displacement.size())};
    }
  }
  std::vector<double> all;
  for (const record::CycleRow& cycle : cycles)
    all.insert(all.end(), cycle.displacement.begin(), cycle.displacement.end());
  const std::size_t points = first.displacement.size();
  data.cycles += static_cast<int>(cycles.size());
  RunData& run = data.runs.emplace_back();
  put_excitation(mean_excitation_of(cycles), run);
  put_mean_cycle(estimator::mean_cycle(all, points), run);
  if (!harmonics) return {};
  return put_harmonics(all, points, place, run);
}

Result<void> add_run(const std::vector<record::CycleRow>& cycles, const std::string& name,
                     const std::string& file, int periods, bool harmonics, CampaignData& data) {
  const std::string place = fmt::format("{}: run {}", file, name);
  if (periods > 1) {
    auto run = run_over_periods(cycles, place, name, periods);
    if (!run) return run.error();
    data.cycles += static_cast<int>(run->cycles);
    data.runs.push_back(std::move(run->data));
    return {};
  }
  std::vector<record::CycleRow> accepted(cycles);
  std::erase_if(accepted, [](const record::CycleRow& cycle) { return !cycle.accepted; });
  doubt_run(accepted.empty() ? cycles : accepted, name, !accepted.empty(), data);
  if (accepted.empty()) return {};
  return add_accepted(accepted, place, harmonics, data);
}

// What the campaign's file said of a run, and the means of the auxiliary channels where that does
// not say more.
Result<config::RunCondition> condition_of_run(const record::CampaignReader& reader,
                                              const record::CampaignRow& campaign,
                                              const record::RunRow& row, bool channel_means) {
  config::RunCondition condition;
  for (config::RunCondition& said : config::run_conditions(campaign.spec_json)) {
    if (said.run == row.name) condition = std::move(said);
  }
  condition.run = row.name;
  if (campaign.auxiliary.empty() || !channel_means) return condition;
  const auto samples = reader.samples(row.index);
  if (!samples) return samples.error();
  std::map<protocol::Channel, std::pair<double, double>> sums;  // of values, and their count
  for (const record::SampleRow& sample : *samples) {
    if (!protocol::is_auxiliary(sample.channel) || !std::isfinite(sample.value)) continue;
    sums[sample.channel].first += sample.value;
    sums[sample.channel].second += 1.0;
  }
  for (const auto& [channel, sum] : sums) {
    const auto label = campaign.auxiliary.find(channel);
    if (label == campaign.auxiliary.end()) continue;
    const auto unit = unit_called(label->second.unit);
    const double mean = sum.first / sum.second;
    condition.values.emplace(label->second.name, unit ? unit->to_si(mean) : mean);
  }
  return condition;
}

}  // namespace

void put_mean_cycle(estimator::MeanCycle mean, RunData& run) {
  run.displacement = std::move(mean.mean);
  run.scatter = mean.scatter;
  run.cycles = mean.cycles;
}

estimator::CycleExcitation mean_excitation_of(const std::vector<record::CycleRow>& rows) {
  std::vector<estimator::CycleExcitation> all;
  for (const record::CycleRow& row : rows)
    all.push_back({row.frequency_hz, row.amplitude, row.excitation, row.excitation_error});
  return mean_excitation(all);
}

Result<void> put_harmonics(const std::vector<double>& y, std::size_t n, const std::string& origin,
                           RunData& run) {
  const std::size_t cycles = y.size() / n;
  const std::size_t count =
      std::min(estimator::coefficients_for(static_cast<long>(cycles), kHarmonics), n - 1 + n % 2);
  if (count < 3)
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: {} cycle{} of a run cannot weigh Fourier coefficients; at least 7 "
                    "whole cycles are needed, or another objective",
                    origin, cycles, cycles == 1 ? "" : "s")};
  estimator::HarmonicMean mean(count);
  for (std::size_t c = 0; c < cycles; ++c)
    mean.add({&y[c * n], n});
  mean.into(run);
  return {};
}

const std::vector<double>& stroke_of(const CsvTable& table) {
  return table.columns.at(table.columns.contains("y") ? "y" : "displacement");
}

Result<RunData> run_from_table(const CsvTable& table, const std::string& origin,
                               const Dwell& dwell) {
  const auto& t = table.columns.at("t");
  const bool measured = table.columns.contains("excitation");
  if (auto good = check(t, origin, dwell, measured); !good) return good.error();
  const std::vector<double>& y = stroke_of(table);
  RunData run;
  std::vector<double> tau;
  for (const double at : t)
    tau.push_back(estimator::phase_of(at, dwell.frequency_hz));
  if (measured) put_excitation(estimator::fit_excitation(tau, table.columns.at("excitation")), run);
  run.frequency_hz = dwell.frequency_hz;
  run.amplitude = dwell.amplitude.value_or(0.0);
  if (const std::size_t n = points_of_even_grid(t, dwell.frequency_hz)) {
    put_mean_cycle(estimator::mean_cycle(y, n), run);
    if (dwell.harmonics) {
      if (auto good = put_harmonics(y, n, origin, run); !good) return good.error();
    }
  } else if (dwell.harmonics) {
    return Error{
        ErrorKind::invalid,
        fmt::format("{}: its points do not stand on equal steps of whole periods, so there "
                    "are no cycles to compare; choose another objective",
                    origin)};
  } else {
    run.tau = std::move(tau);
    run.displacement = y;
  }
  return run;
}

Result<CsvTable> read_run_table(const std::filesystem::path& file, const std::string& length_unit) {
  auto table =
      read_csv(file, {{"t", "excitation", "displacement"}, {"t", "y"}, {"t", "displacement"}});
  if (!table) return table;
  if (auto good = to_model_units(*table, file.string(), {length_unit}); !good) return good.error();
  return table;
}

Result<CampaignData> runs_from_database(const std::filesystem::path& file, bool harmonics,
                                        const PeriodsOfRuns& periods, bool channel_means) {
  if (auto good = expect_file(file); !good) return good.error();
  const auto reader = record::CampaignReader::open(file);
  if (!reader) return reader.error();
  const auto campaign = reader->campaign();
  if (!campaign) return campaign.error();
  const auto runs = reader->runs();
  if (!runs) return runs.error();
  if (auto good = check_names(periods, *runs, file.string()); !good) return good.error();
  CampaignData data;
  data.name = campaign->name;
  data.model_json = campaign->model_json;
  for (const record::RunRow& row : *runs) {
    const auto cycles = reader->cycles(row.index);
    if (!cycles) return cycles.error();
    const std::size_t before = data.runs.size();
    if (auto good =
            add_run(*cycles, row.name, file.string(), periods.of(row.name), harmonics, data);
        !good)
      return good.error();
    if (data.runs.size() == before) continue;
    auto condition = condition_of_run(*reader, *campaign, row, channel_means);
    if (!condition) return condition.error();
    data.runs.back().condition = std::move(*condition);
  }
  if (data.runs.empty()) {
    std::string why = "holds no accepted cycle, so there is nothing to estimate from";
    for (const std::string& warning : data.warnings)
      why += "; " + warning;
    return Error{ErrorKind::invalid, fmt::format("{}: {}", file.string(), why)};
  }
  return data;
}

}  // namespace shaker::cli
