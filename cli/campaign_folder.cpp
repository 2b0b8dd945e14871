#include "cli/campaign_folder.hpp"

#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "cli/csv.hpp"
#include "record/accepted_cycles.hpp"

namespace shaker::cli {
namespace {

using estimator::discrepancy::Campaign;
using estimator::discrepancy::Kind;
using estimator::discrepancy::Recording;
using estimator::discrepancy::Role;
using nlohmann::json;

constexpr std::size_t kLargestFile = 4 * 1024 * 1024;

Error invalid(const std::string& where, const std::string& why) {
  return {ErrorKind::invalid, where + ": " + why};
}

// Metres in a unit of length, or nothing.
std::optional<double> metres(const std::string& unit) {
  static const std::map<std::string, double> known = {{"m", 1.0},   {"cm", 0.01},   {"mm", 1e-3},
                                                      {"um", 1e-6}, {"in", 0.0254}, {"ft", 0.3048}};
  const auto found = known.find(unit);
  return found == known.end() ? std::nullopt : std::optional(found->second);
}

struct Factors {
  double time = 1.0, displacement = 1.0, excitation = 1.0;
};

// What turns the file's numbers into the model's.
Result<Factors> factors_of(const json& document, const std::string& where,
                           const config::ModelSpec& model) {
  Factors factors;
  const json units = document.value("units", json::object());
  if (!units.is_object()) return invalid(where, "/units is not an object");
  const auto unit = [&](const char* name, const std::string& otherwise) {
    const auto at = units.find(name);
    return at != units.end() && at->is_string() ? at->get<std::string>() : otherwise;
  };
  const std::string time = unit("time", "s");
  if (time == "ms")
    factors.time = 1e-3;
  else if (time == "us")
    factors.time = 1e-6;
  else if (time != "s")
    return invalid(where, fmt::format("/units/time is \"{}\"; it is s, ms or us", time));
  const std::string length = unit("displacement", model.length_unit);
  const auto wanted = metres(model.length_unit);
  if (length != model.length_unit) {
    const auto given = metres(length);
    if (!given || !wanted)
      return invalid(where, fmt::format("/units/displacement is \"{}\" and the model counts in "
                                        "\"{}\": these do not match",
                                        length, model.length_unit));
    factors.displacement = *given / *wanted;
  }
  const std::string same = model.length_unit + "/s^2";
  const std::string acceleration = unit("excitation", same);
  if (acceleration != same) {
    const auto slash = acceleration.find("/s^2");
    const auto given =
        slash == std::string::npos ? std::nullopt : metres(acceleration.substr(0, slash));
    if (acceleration == "g" && wanted)
      factors.excitation = 9.80665 / *wanted;
    else if (given && wanted)
      factors.excitation = *given / *wanted;
    else
      return invalid(where, fmt::format("/units/excitation is \"{}\" and the model counts in "
                                        "\"{}\": these do not match",
                                        acceleration, same));
  }
  return factors;
}

Result<Kind> kind_of(const json& run, const std::string& where) {
  const std::string kind = run.value("kind", "periodic");
  if (kind == "periodic") return Kind::periodic;
  if (kind == "imposed_motion") return Kind::imposed_motion;
  if (kind == "transient") return Kind::transient;
  return invalid(where,
                 fmt::format("kind \"{}\" is none of periodic, imposed_motion, transient", kind));
}

void scale(std::vector<double>& column, double factor) {
  for (double& value : column)
    value *= factor;
}

std::vector<std::vector<std::string>> columns_wanted(Kind kind) {
  if (kind == Kind::imposed_motion) return {{"t", "displacement", "force"}};
  return {{"t", "excitation", "displacement", "acceleration"},
          {"t", "excitation", "displacement"},
          {"t", "displacement"}};
}

Result<Recording> read_run(const json& run, const std::filesystem::path& folder,
                           const std::string& where, const Factors& factors) {
  Recording recording;
  recording.name = run.value("name", "");
  if (recording.name.empty()) return invalid(where, "the run has no name");
  const auto kind = kind_of(run, where);
  if (!kind) return kind.error();
  recording.kind = *kind;
  const std::string role = run.value("role", "");
  if (!role.empty() && role != "fit" && role != "held_out")
    return invalid(where, fmt::format("role \"{}\" is neither fit nor held_out", role));
  recording.role_given = !role.empty();
  recording.role = role == "held_out" ? Role::held_out : Role::fit;
  recording.frequency_hz = run.value("frequency_hz", 0.0);
  recording.amplitude = run.value("amplitude", 0.0) * factors.excitation;
  const std::filesystem::path file = run.value("file", recording.name + ".csv");
  if (file.is_absolute() || file.string().find("..") != std::string::npos)
    return invalid(where,
                   fmt::format("file \"{}\" is not in the campaign's folder", file.string()));
  auto table = read_csv(folder / file, columns_wanted(recording.kind));
  if (!table) return table.error();
  const auto take = [&](const char* name) {
    const auto found = table->columns.find(name);
    return found == table->columns.end() ? std::vector<double>() : std::move(found->second);
  };
  recording.t = take("t");
  recording.displacement = take("displacement");
  recording.excitation = take("excitation");
  recording.acceleration = take("acceleration");
  recording.force = take("force");
  scale(recording.t, factors.time);
  scale(recording.displacement, factors.displacement);
  scale(recording.excitation, factors.excitation);
  scale(recording.acceleration, factors.excitation);
  return recording;
}

void use_gravity(const json& document, config::ModelSpec& model, Campaign& campaign) {
  const auto given = document.find("gravity");
  if (given == document.end() || !given->is_number()) return;
  const double in_model = given->get<double>() / metres(model.length_unit).value_or(1.0);
  if (std::fabs(in_model / model.gravity - 1.0) > 1e-6)
    campaign.warnings.push_back(
        fmt::format("the campaign's gravity, {:.6g} {}/s^2, is used instead "
                    "of the model's {:.6g}",
                    in_model, model.length_unit, model.gravity));
  model.gravity = in_model;
}

Result<Campaign> read_document(const json& document, const std::filesystem::path& folder,
                               const std::string& where, config::ModelSpec& model) {
  if (document.value("format", "") != "shaker-campaign/1")
    return invalid(where, "/format is not \"shaker-campaign/1\"");
  const auto factors = factors_of(document, where, model);
  if (!factors) return factors.error();
  const auto runs = document.find("runs");
  if (runs == document.end() || !runs->is_array() || runs->empty())
    return invalid(where, "/runs is missing or empty");
  Campaign campaign;
  campaign.name = document.value("name", folder.filename().string());
  use_gravity(document, model, campaign);
  for (std::size_t i = 0; i < runs->size(); ++i) {
    auto run = read_run((*runs)[i], folder, fmt::format("{}: /runs/{}", where, i), *factors);
    if (!run) return run.error();
    campaign.runs.push_back(std::move(*run));
  }
  return campaign;
}

Result<Campaign> read_folder(const std::filesystem::path& folder, config::ModelSpec& model) {
  const auto file = folder / "campaign.json";
  std::error_code trouble;
  const auto size = std::filesystem::file_size(file, trouble);
  if (trouble)
    return invalid(file.string(), "cannot be read: " + trouble.message() +
                                      "; a campaign's folder holds campaign.json and a CSV a run");
  if (size > kLargestFile) return invalid(file.string(), "is too large for a campaign.json");
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  try {
    // No deeper than a campaign is: nesting must not exhaust the stack.
    const auto shallow = [](int depth, json::parse_event_t, json&) { return depth < 16; };
    const json document = json::parse(text.str(), shallow, true, true);
    if (!document.is_object()) return invalid(file.string(), "is not a JSON object");
    return read_document(document, folder, file.string(), model);
  } catch (const json::exception& error) {
    return invalid(file.string(), error.what());
  }
}

Result<Campaign> read_database(const std::filesystem::path& file) {
  const auto reader = record::CampaignReader::open(file);
  if (!reader) return reader.error();
  const auto row = reader->campaign();
  if (!row) return row.error();
  auto runs = record::accepted_cycles(*reader);
  if (!runs) return runs.error();
  Campaign campaign;
  campaign.name = row->name;
  for (record::AcceptedCycles& run : *runs) {
    if (run.t.empty()) {
      campaign.warnings.push_back(
          fmt::format("run {} has no accepted cycle and is left out", run.name));
      continue;
    }
    Recording recording;
    recording.name = std::move(run.name);
    recording.frequency_hz = run.frequency_hz;
    recording.amplitude = run.amplitude;
    recording.t = std::move(run.t);
    recording.displacement = std::move(run.displacement);
    recording.excitation = std::move(run.excitation);
    campaign.runs.push_back(std::move(recording));
  }
  if (campaign.runs.empty()) return invalid(file.string(), "holds no accepted cycle");
  return campaign;
}

}  // namespace

Result<Campaign> read_campaign(const std::filesystem::path& path, config::ModelSpec& model) {
  std::error_code trouble;
  if (std::filesystem::is_directory(path, trouble)) return read_folder(path, model);
  const auto extension = path.extension();
  if (extension == ".db" || extension == ".sqlite") return read_database(path);
  return invalid(path.string(), "is neither a campaign's folder nor a campaign database (.db)");
}

}  // namespace shaker::cli
