#include "cli/data/export_data.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "cli/campaign_folder.hpp"
#include "cli/opened_campaign.hpp"
#include "config/campaign.hpp"
#include "config/json_tree.hpp"
#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/cycles/steady_cycles.hpp"

namespace shaker::cli {
namespace {

std::vector<ExportChannel> channels_of(const std::vector<record::SampleRow>& samples,
                                       const protocol::ChannelLabels& labels) {
  std::vector<ExportChannel> all(protocol::kChannelCount);
  for (const record::SampleRow& sample : samples) {
    ExportChannel& channel = all.at(static_cast<std::size_t>(sample.channel));
    channel.t.push_back(1e-9 * static_cast<double>(sample.t_ns - samples.front().t_ns));
    channel.value.push_back(sample.value);
    channel.quality.push_back(sample.quality);
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto label = protocol::label(static_cast<protocol::Channel>(i), labels);
    all[i].name = label.name;
    all[i].unit = label.unit;
  }
  std::erase_if(all, [](const ExportChannel& channel) { return channel.t.empty(); });
  return all;
}

Result<ExportData> export_of_database(const std::filesystem::path& database,
                                      const ExportWanted& wanted) {
  const auto reader = record::CampaignReader::open(database);
  if (!reader) return reader.error();
  const auto campaign = reader->campaign();
  if (!campaign) return campaign.error();
  const auto runs = reader->runs();
  if (!runs) return runs.error();
  ExportData data{*campaign, {}};
  for (const record::RunRow& row : *runs) {
    ExportRun run{row, {}, {}};
    auto cycles = reader->cycles(row.index);
    if (!cycles) return cycles.error();
    run.cycles = std::move(*cycles);
    if (!wanted.left_out)
      std::erase_if(run.cycles, [](const record::CycleRow& c) { return !c.accepted; });
    if (wanted.samples) {
      const auto samples = reader->samples(row.index);
      if (!samples) return samples.error();
      run.channels = channels_of(*samples, campaign->auxiliary);
    }
    data.runs.push_back(std::move(run));
  }
  return data;
}

// Steady cycles on a grid of phases, as they are read for an estimate.
Result<std::vector<record::CycleRow>> cycles_of_recording(
    const estimator::diagnosis::Recording& recording, int run, const std::string& place) {
  namespace diagnosis = estimator::diagnosis;
  constexpr int kPhases = 64;
  if (recording.kind != diagnosis::Kind::periodic)
    return Error{ErrorKind::invalid,
                 fmt::format("{}: run {} is not periodic and has no cycles; export its --samples",
                             place, recording.name)};
  const auto steady = diagnosis::steady_cycles(recording);
  if (!steady) return Error{steady.error().kind, fmt::format("{}: {}", place, steady.error().what)};
  const auto curve = [&](const Eigen::MatrixXd& rows, int cycle) {
    const Eigen::VectorXd values = diagnosis::synthesised(rows.row(cycle).transpose(), kPhases);
    return std::vector<double>(values.data(), values.data() + values.size());
  };
  std::vector<record::CycleRow> cycles;
  for (int k = 0; k < steady->cycles(); ++k) {
    record::CycleRow cycle;
    cycle.run = run;
    cycle.index = k;
    cycle.accepted = true;
    cycle.frequency_hz = steady->frequency_hz;
    cycle.amplitude = steady->driver_measured
                          ? std::hypot(steady->driver(k, 1), steady->driver(k, 2))
                          : recording.amplitude;
    cycle.displacement = curve(steady->response, k);
    if (steady->driver_measured) cycle.excitation = curve(steady->driver, k);
    cycles.push_back(std::move(cycle));
  }
  return cycles;
}

std::vector<ExportChannel> channels_of_recording(const estimator::diagnosis::Recording& recording,
                                                 double reference_mass) {
  std::vector<ExportChannel> channels;
  const auto add = [&](const char* name, const char* unit, std::vector<double> values) {
    if (values.empty()) return;
    const std::size_t size = values.size();
    channels.push_back({name, unit, recording.t, std::move(values),
                        std::vector<std::uint8_t>(size, std::uint8_t{0})});
  };
  add("displacement", "m", recording.displacement);
  add("excitation", "m/s^2", recording.excitation);
  add("acceleration", "m/s^2", recording.acceleration);
  std::vector<double> force = recording.force;
  for (double& value : force)
    value *= reference_mass > 0.0 ? reference_mass : 1.0;
  add("force", reference_mass > 0.0 ? "N" : "m/s^2", std::move(force));
  return channels;
}

Result<ExportData> export_of_folder(const std::filesystem::path& folder,
                                    const ExportWanted& wanted) {
  if (wanted.left_out)
    return Error{
        ErrorKind::invalid,
        folder.string() + ": a folder does not say which cycles were accepted; leave --all out"};
  config::ModelSpec metres;
  const auto campaign = read_campaign(folder, metres);
  if (!campaign) return campaign.error();
  const auto text = config::read_text(folder / "campaign.json");
  if (!text) return text.error();
  ExportData data;
  data.campaign.name = campaign->name;
  data.campaign.spec_json = *text;
  const double mass = config::reference_mass(*text);
  for (const auto& recording : campaign->runs) {
    ExportRun run;
    run.row.index = static_cast<int>(data.runs.size());
    run.row.name = recording.name;
    run.row.frequency_hz = recording.frequency_hz;
    run.row.amplitude = recording.amplitude;
    if (wanted.samples) {
      run.channels = channels_of_recording(recording, mass);
    } else {
      auto cycles = cycles_of_recording(recording, run.row.index, folder.string());
      if (!cycles) return cycles.error();
      run.cycles = std::move(*cycles);
      run.row.frequency_hz = run.cycles.front().frequency_hz;
      if (run.row.amplitude == 0.0) run.row.amplitude = run.cycles.front().amplitude;
      run.row.cycles_wanted = static_cast<int>(run.cycles.size());
    }
    data.runs.push_back(std::move(run));
  }
  return data;
}

}  // namespace

double ExportRun::mean_frequency() const {
  if (cycles.empty()) return row.frequency_hz;
  return std::accumulate(cycles.begin(), cycles.end(), 0.0,
                         [](double sum, const auto& cycle) { return sum + cycle.frequency_hz; }) /
         static_cast<double>(cycles.size());
}

Result<ExportData> read_export(const std::filesystem::path& campaign, const ExportWanted& wanted) {
  if (auto good = expect_campaign(campaign); !good) return good.error();
  return place_of(campaign) == Place::folder ? export_of_folder(campaign, wanted)
                                             : export_of_database(campaign, wanted);
}

std::string plain_file_name(std::string name) {
  for (char& c : name) {
    if (c == '/' || static_cast<unsigned char>(c) <= 0x20) c = '_';
  }
  if (name.starts_with('.')) name[0] = '_';
  for (auto at = name.find(".."); at != name.npos; at = name.find("..", at))
    name[at] = '_';
  return name;
}

std::string export_name(const ExportData& data, const std::string& rest) {
  return plain_file_name(fmt::format("{}_{}", data.campaign.name, rest));
}

}  // namespace shaker::cli
