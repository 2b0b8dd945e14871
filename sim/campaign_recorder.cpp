#include "sim/campaign_recorder.hpp"

#include <cmath>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/os.h>
#include <nlohmann/json.hpp>

namespace shaker::sim {
namespace {

constexpr double kGravity = 9.80665;

nlohmann::ordered_json described(const RecordedRun& run) {
  return {{"name", run.name},
          {"file", run.name + ".csv"},
          {"frequency_hz", run.frequency_hz},
          {"amplitude", run.amplitude},
          {"role", run.held_out ? "held_out" : "fit"},
          {"kind", "periodic"}};
}

void write_csv(const Record& record, const std::filesystem::path& file) {
  auto out = fmt::output_file(file.string());
  out.print("t,excitation,displacement\n");
  for (std::size_t i = 0; i < record.t.size(); ++i) {
    out.print("{:.7f},{:.7g},{:.9g}\n", record.t[i], record.excitation[i], record.displacement[i]);
  }
}

double gravity_of(const RigOptions& rig) {
  const auto given = rig.parameters.find("gravity");
  return given == rig.parameters.end() ? kGravity : given->second;
}

}  // namespace

Record record_run(const CampaignRecording& campaign, std::size_t index) {
  const RecordedRun& run = campaign.runs.at(index);
  RigOptions options = campaign.rig;
  options.heartbeat_timeout_s = 0.0;
  options.seed = campaign.rig.seed + 7919 * index;  // so that each run has its own noise
  const Nanoseconds start{0};
  VirtualRig rig(options, start);
  if (!rig.set_ramp(campaign.ramp_s) || !rig.set_frequency(run.frequency_hz) ||
      !rig.set_amplitude(run.amplitude) || !(run.frequency_hz > 0.0) || !rig.set_enable(true)) {
    throw std::invalid_argument(
        fmt::format("run {}: {} Hz, {} m/s^2 and a ramp of {} s are not all within the rig's range",
                    run.name, run.frequency_hz, run.amplitude, campaign.ramp_s));
  }
  const double length =
      campaign.ramp_s + (campaign.settle_cycles + campaign.cycles) / run.frequency_hz;
  std::vector<RigSample> samples;
  samples.reserve(static_cast<std::size_t>(length * options.sample_rate_hz) + 2);
  rig.advance(start + Nanoseconds(std::llround(length * 1e9)), samples);
  if (const auto fault = rig.status().fault; fault != 0) {
    throw std::runtime_error(fmt::format(
        "run {}: the rig tripped with fault {} (3: the damper bottomed); lower the amplitude",
        run.name, fault));
  }
  Record record;
  for (const auto& sample : samples) {
    if (sample.dropped) continue;
    record.t.push_back(seconds(sample.t - start));
    record.excitation.push_back(sample.excitation);
    record.displacement.push_back(sample.displacement);
  }
  return record;
}

void write_campaign(const CampaignRecording& campaign, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  nlohmann::ordered_json document = {
      {"format", "shaker-campaign/1"},
      {"units", {{"time", "s"}, {"displacement", "m"}, {"excitation", "m/s^2"}}},
      {"gravity", gravity_of(campaign.rig)},
      {"runs", nlohmann::ordered_json::array()}};
  for (std::size_t i = 0; i < campaign.runs.size(); ++i) {
    write_csv(record_run(campaign, i), folder / (campaign.runs[i].name + ".csv"));
    document["runs"].push_back(described(campaign.runs[i]));
  }
  std::ofstream out(folder / "campaign.json");
  out << document.dump(2) << '\n';
  out.close();
  if (!out) {
    throw std::runtime_error(
        fmt::format("{}: cannot be written", (folder / "campaign.json").string()));
  }
}

}  // namespace shaker::sim
