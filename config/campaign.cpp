#include "config/campaign.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "config/model_reader.hpp"
#include "config/sweep.hpp"

namespace shaker::config {
namespace {

// Reads "model": a path relative to the campaign's file, or the model itself.
void read_model_member(ObjectReader& reader, Findings& findings, const std::string& origin,
                       const std::filesystem::path& directory, ModelSpec& model) {
  const Node* node = reader.member("model", true);
  if (!node) return;
  if (node->kind != Node::Kind::string) {
    model = read_model(*node, "/model", findings, origin);
    return;
  }
  std::string path;
  reader.required("model", path);
  if (path.empty()) return;
  auto loaded = load_model(directory / path);
  if (loaded) {
    model = std::move(loaded).value();
  } else {
    reader.complain("model", fmt::format("the model file is not good:\n{}", loaded.error().what));
  }
}

constexpr std::size_t kRunsMax = 10000;

// One run, or one for each step of a sweep.
void add_dwells(ObjectReader& reader, const RunSpec& run, const std::vector<double>& frequencies,
                const std::vector<double>& amplitudes, std::set<std::string>& names,
                std::vector<RunSpec>& runs) {
  const std::size_t steps = std::max(frequencies.size(), amplitudes.size());
  for (std::size_t k = 0; k < steps && runs.size() <= kRunsMax; ++k) {
    RunSpec dwell = run;
    if (steps > 1) dwell.name = fmt::format("{}_{:02}", run.name, k + 1);
    if (!frequencies.empty()) dwell.frequency_hz = frequencies[std::min(k, frequencies.size() - 1)];
    if (!amplitudes.empty()) dwell.amplitude = amplitudes[std::min(k, amplitudes.size() - 1)];
    if (!names.insert(dwell.name).second) {
      reader.complain("name",
                      fmt::format("\"{}\" is the name of two runs; give each its own", dwell.name));
    }
    runs.push_back(std::move(dwell));
  }
}

void read_runs(ObjectReader& reader, Findings& findings, std::vector<RunSpec>& runs) {
  std::set<std::string> names;
  std::size_t entry = 1;
  reader.array("runs", true, 1, [&](const Node& node, const std::string& pointer) {
    RunSpec run;
    run.name = fmt::format("r{:02}", entry);
    ObjectReader inner(node, pointer, findings);
    if (inner.member("name", false)) inner.required("name", run.name);
    const auto frequencies = read_steps(inner, "frequency_hz", above(0).at_most(1000), findings);
    const auto amplitudes = read_steps(inner, "amplitude", above(0).at_most(1000), findings);
    inner.optional("cycles", run.cycles, at_least(1).at_most(100000));
    read_condition(inner, findings, run.condition);
    inner.finish();
    ++entry;
    if (frequencies.size() > 1 && amplitudes.size() > 1) {
      inner.complain("amplitude",
                     "is a sweep beside a sweep of \"frequency_hz\"; sweep one of the two");
      return;
    }
    add_dwells(inner, run, frequencies, amplitudes, names, runs);
  });
  if (runs.size() > kRunsMax)
    reader.complain("runs", fmt::format("are {} with the steps of their sweeps; at most {} are "
                                        "allowed",
                                        runs.size(), kRunsMax));
}

void read_change_detection(ObjectReader& reader, Findings& findings,
                           std::optional<ChangeDetectionSpec>& spec) {
  const Node* node = reader.member("change_detection", false);
  if (!node) return;
  ObjectReader inner(*node, reader.at("change_detection"), findings);
  ChangeDetectionSpec read;
  inner.optional("false_alarms_per_hour", read.false_alarms_per_hour, above(0).at_most(60));
  inner.optional("false_alarms_per_run", read.false_alarms_per_run, above(0).at_most(1));
  inner.finish();
  if ((read.false_alarms_per_hour > 0.0) == (read.false_alarms_per_run > 0.0)) {
    reader.complain(
        "change_detection",
        "give \"false_alarms_per_hour\" or \"false_alarms_per_run\", one of the two: how "
        "often the test may cry wolf");
  }
  spec = read;
}

}  // namespace

double CampaignSpec::false_alarms_per_cycle() const {
  if (!change_detection) return 0.0;
  double least = 1.0;
  for (const RunSpec& run : runs) {
    least =
        std::min(least, change_detection->false_alarms_per_hour > 0.0
                            ? change_detection->false_alarms_per_hour / 3600.0 / run.frequency_hz
                            : change_detection->false_alarms_per_run / run.cycles);
  }
  return least;
}

Result<CampaignSpec> parse_campaign(const std::string& text, const std::string& origin,
                                    const std::filesystem::path& directory) {
  const auto root = parse_json(text, origin);
  if (!root) return root.error();
  CampaignSpec campaign;
  campaign.origin = origin;
  Findings findings(origin);
  ObjectReader reader(*root, "", findings);
  reader.format("shaker-campaign/1");
  reader.required("name", campaign.name);
  // The name becomes part of a file name.
  if (campaign.name.find('/') != std::string::npos || campaign.name.starts_with('.') ||
      campaign.name.size() > 100) {
    reader.complain("name", fmt::format("\"{}\" is not allowed; at most 100 characters, no '/', "
                                        "no '.' in front: it names the database file",
                                        campaign.name));
  }
  read_model_member(reader, findings, origin, directory, campaign.model);
  read_runs(reader, findings, campaign.runs);
  reader.optional("points_per_cycle", campaign.points_per_cycle, at_least(8).at_most(4096));
  reader.optional("settle_cycles_max", campaign.settle_cycles_max, at_least(8).at_most(100000));
  reader.optional("settle_tolerance", campaign.settle_tolerance, above(0).at_most(1000));
  reader.optional("ramp_s", campaign.ramp_s, at_least(0).at_most(600));
  reader.optional("forgetting", campaign.forgetting, at_least(0.5).at_most(1));
  read_change_detection(reader, findings, campaign.change_detection);
  reader.optional("reference_mass", campaign.reference_mass, above(0).at_most(1e6));
  if (const Node* node = reader.member("specimen", false))
    read_specimen(*node, "/specimen", findings, campaign.specimen);
  reader.optional("resumes", campaign.resumes);
  reader.finish();
  if (!findings.empty()) return findings.error();
  return campaign;
}

Result<CampaignSpec> load_campaign(const std::filesystem::path& file) {
  const auto text = read_text(file);
  if (!text) return text.error();
  return parse_campaign(*text, file.string(), file.parent_path());
}

double reference_mass(const std::string& text) {
  const auto root = nlohmann::json::parse(text, nullptr, false);
  return root.is_object() && root.contains("reference_mass") && root["reference_mass"].is_number()
             ? root["reference_mass"].get<double>()
             : 0.0;
}

std::string to_json_text(const CampaignSpec& campaign) {
  using Json = nlohmann::ordered_json;
  Json runs = Json::array();
  for (const RunSpec& run : campaign.runs) {
    runs.push_back({{"name", run.name},
                    {"frequency_hz", run.frequency_hz},
                    {"amplitude", run.amplitude},
                    {"cycles", run.cycles}});
    if (!run.condition.group.empty()) runs.back()["group"] = run.condition.group;
    if (!run.condition.values.empty()) runs.back()["conditions"] = run.condition.values;
  }
  Json root = {{"format", "shaker-campaign/1"},
               {"name", campaign.name},
               {"model", Json::parse(to_json_text(campaign.model))},
               {"runs", std::move(runs)},
               {"points_per_cycle", campaign.points_per_cycle},
               {"settle_cycles_max", campaign.settle_cycles_max},
               {"settle_tolerance", campaign.settle_tolerance},
               {"ramp_s", campaign.ramp_s},
               {"forgetting", campaign.forgetting}};
  if (campaign.reference_mass > 0.0) root["reference_mass"] = campaign.reference_mass;
  for (const auto& [key, text] : entries(campaign.specimen))
    root["specimen"][key] = text;
  if (!campaign.resumes.empty()) root["resumes"] = campaign.resumes;
  if (const auto& change = campaign.change_detection) {
    if (change->false_alarms_per_hour > 0.0)
      root["change_detection"] = {{"false_alarms_per_hour", change->false_alarms_per_hour}};
    else
      root["change_detection"] = {{"false_alarms_per_run", change->false_alarms_per_run}};
  }
  return root.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace shaker::config
