#include "cli/channel_data.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/campaign_place.hpp"
#include "cli/csv.hpp"
#include "cli/model_units.hpp"
#include "cli/opened_campaign.hpp"
#include "cli/run_data.hpp"
#include "config/campaign.hpp"
#include "estimator/signal/cycles.hpp"
#include "estimator/signal/time_series.hpp"
#include "record/campaign_database.hpp"

namespace shaker::cli {
namespace {

using estimator::ChannelRun;
using estimator::Quantity;
using estimator::TimeSeries;
using Series = std::vector<std::vector<double>>;  // one inner vector for each channel

Error bad(std::string why) {
  return Error{ErrorKind::invalid, std::move(why)};
}

Result<ChannelInput> describe(const std::vector<std::string>& channels,
                              std::optional<double> mass) {
  ChannelInput out;
  for (std::size_t b = 0; b < channels.size(); ++b) {
    if (std::find(channels.begin(), channels.begin() + static_cast<std::ptrdiff_t>(b),
                  channels[b]) != channels.begin() + static_cast<std::ptrdiff_t>(b))
      return bad(fmt::format("channel {} is named twice", channels[b]));
    double scale = 1.0;
    if (channels[b] == "displacement") {
      out.quantities.push_back(Quantity::displacement);
      out.units.emplace_back("m");
    } else if (channels[b] == "acceleration") {
      out.quantities.push_back(Quantity::absolute_acceleration);
      out.units.emplace_back("m/s^2");
    } else if (channels[b] == "force") {
      if (!mass || !(*mass > 0.0))
        return bad(
            "the model's forces are per unit mass, a load cell's are not: give the mass that "
            "it carries with --mass, in kg, or in the campaign's file as \"reference_mass\"");
      out.quantities.push_back(Quantity::damper_force);
      out.units.emplace_back("N");
      scale = *mass;
    } else {
      return bad(
          fmt::format("there is no channel \"{}\"; there are displacement, acceleration and "
                      "force",
                      channels[b]));
    }
    out.scale.push_back(scale);
  }
  return out;
}

// Puts the mean of whole cycles of n points and their scatter.
void fold(const Series& cycles, std::size_t n, ChannelRun& run) {
  estimator::MeanChannels mean = estimator::mean_channels(cycles, n);
  run.cycles = mean.cycles;
  run.channels = std::move(mean.mean);
  run.scatter = std::move(mean.scatter);
}

Result<ChannelInput> from_csv(const InputOptions& options, const std::vector<std::string>& channels,
                              ChannelInput out) {
  if (options.model.empty())
    return bad("a CSV file does not say which model; give --model MODEL.json");
  if (!options.frequency_hz)
    return bad("a CSV file does not say its frequency; give --frequency in Hz");
  auto model = config::load_model(options.model);
  if (!model) return model.error();
  if (auto good = check_units(*model); !good) return good.error();
  out.model = std::move(*model);
  std::vector<std::string> plain = {"t"}, measured = {"t", "excitation"}, old = {"t"};
  for (const std::string& name : channels) {
    plain.push_back(name);
    measured.push_back(name);
    old.push_back(name == "displacement" ? "y" : name);
  }
  auto table = read_csv(options.file(), {measured, plain, old});
  if (!table) return table.error();
  // A force is divided by the mass below.
  const ModelUnits units = {out.model.length_unit, 1.0};
  if (auto good = to_model_units(*table, options.file().string(), units); !good)
    return good.error();
  // Times and excitation are read as for one channel; then all channels are treated alike.
  CsvTable first;
  first.columns["t"] = table->columns.at("t");
  const bool with_excitation = table->columns.contains("excitation");
  if (with_excitation) first.columns["excitation"] = table->columns.at("excitation");
  Series series;
  for (std::size_t b = 0; b < channels.size(); ++b) {
    const bool y = !table->columns.contains(channels[b]);
    series.push_back(table->columns.at(y ? "y" : channels[b]));
    for (double& value : series.back())
      value /= out.scale[b];
  }
  first.columns[with_excitation ? "displacement" : "y"] = series.front();
  const auto as_one =
      run_from_table(first, options.file().string(), {*options.frequency_hz, options.amplitude});
  if (!as_one) return as_one.error();
  ChannelRun run;
  run.frequency_hz = as_one->frequency_hz;
  run.amplitude = as_one->amplitude;
  run.excitation = as_one->excitation;
  run.excitation_error = as_one->excitation_error;
  run.condition.run = "1";
  run.tau = as_one->tau;
  if (run.tau.empty())
    fold(series, as_one->displacement.size(), run);
  else
    run.channels = std::move(series);
  out.runs.push_back(std::move(run));
  return out;
}

TimeSeries pick(const std::vector<record::SampleRow>& samples, protocol::Channel channel) {
  TimeSeries raw;
  for (const record::SampleRow& sample : samples) {
    const double t = 1e-9 * static_cast<double>(sample.t_ns - samples.front().t_ns);
    if (sample.channel != channel || (!raw.t.empty() && t <= raw.t.back())) continue;
    raw.t.push_back(t);
    raw.value.push_back(sample.value);
  }
  return raw;
}

Result<ChannelRun> from_samples(const estimator::RunData& mean,
                                const std::vector<record::SampleRow>& samples,
                                const std::vector<std::string>& channels,
                                const std::vector<double>& scale, const std::string& place) {
  const TimeSeries stroke = pick(samples, protocol::Channel::displacement);
  std::vector<TimeSeries> raw;
  double first = 0.0, last = 1e300;
  for (std::size_t b = 0; b < channels.size(); ++b) {
    raw.push_back(pick(samples, *protocol::channel_from_name(channels[b])));
    if (raw.back().t.size() < 16)
      return bad(
          fmt::format("{}: {} samples of the {} were recorded; leave it out of --channels, or "
                      "record it",
                      place, raw.back().t.size(), channels[b]));
    for (double& value : raw.back().value)
      value /= scale[b];
    first = std::max(first, raw.back().t.front());
    last = std::min(last, raw.back().t.back());
  }
  if (stroke.t.size() < 16) return bad(fmt::format("{}: no displacement was recorded", place));
  first = std::max(first, stroke.t.front());
  last = std::min(last, stroke.t.back());
  const double period = 1.0 / mean.frequency_hz;
  const std::size_t n = mean.displacement.size();
  const int periods = std::min(static_cast<int>(mean.cycles + 0.5),
                               static_cast<int>(std::floor((last - first) / period)) - 1);
  if (periods < 1) return bad(fmt::format("{}: its raw samples span less than two periods", place));
  const double begin = begin_in_phase(stroke, mean.displacement, {first, last}, period, periods);
  if (begin + periods * period > last + 1e-9)
    return bad(fmt::format("{}: its raw samples do not hold {} whole periods", place, periods));
  Series series;
  for (const TimeSeries& each : raw)
    series.push_back(each.periods(begin, period, periods, n));
  ChannelRun run;
  run.frequency_hz = mean.frequency_hz;
  run.amplitude = mean.amplitude;
  run.excitation = mean.excitation;
  run.excitation_error = mean.excitation_error;
  run.condition = mean.condition;
  fold(series, n, run);
  return run;
}

Result<ChannelInput> from_database(const InputOptions& options,
                                   const std::vector<std::string>& channels, ChannelInput out) {
  auto input = read_estimation_input(options);
  if (!input) return input.error();
  out.model = std::move(input->model);
  out.campaign = input->campaign;
  const auto reader = record::CampaignReader::open(options.file());
  if (!reader) return reader.error();
  const auto rows = reader->runs();
  if (!rows) return rows.error();
  std::size_t next = 0;
  for (const record::RunRow& row : *rows) {
    const auto cycles = reader->cycles(row.index);
    if (!cycles) return cycles.error();
    if (std::none_of(cycles->begin(), cycles->end(),
                     [](const record::CycleRow& cycle) { return cycle.accepted; }))
      continue;
    const auto samples = reader->samples(row.index);
    if (!samples) return samples.error();
    auto run = from_samples(input->runs.at(next++), *samples, channels, out.scale,
                            fmt::format("{}: run {}", options.file().string(), row.name));
    if (!run) return run.error();
    out.runs.push_back(std::move(*run));
  }
  return out;
}

// The reference mass in the campaign's specification, which the database stores.
std::optional<double> mass_of(const std::filesystem::path& database) {
  const auto reader = record::CampaignReader::open(database);
  const auto row = reader ? reader->campaign() : reader.error();
  if (!row) return {};  // read_estimation_input reports this error
  const double mass = config::reference_mass(row->spec_json);
  return mass > 0.0 ? std::optional(mass) : std::nullopt;
}

}  // namespace

Result<ChannelInput> read_channels(const InputOptions& options,
                                   const std::vector<std::string>& channels,
                                   std::optional<double> mass) {
  if (options.files.size() > 1)
    return bad("channels are read from one database or CSV file; give one");
  if (place_of(options.file()) == Place::folder)
    return bad(options.file().string() +
               ": is a folder, of which `estimate` fits the displacement "
               "alone; leave --channels, --stagewise and --objective maximum_likelihood or "
               "joint_covariance out");
  if (auto good = expect_file(options.file()); !good) return good.error();
  if (!mass && is_database(options.file())) mass = mass_of(options.file());
  auto described = describe(channels, mass);
  if (!described) return described.error();
  return is_database(options.file()) ? from_database(options, channels, std::move(*described))
                                     : from_csv(options, channels, std::move(*described));
}

}  // namespace shaker::cli
