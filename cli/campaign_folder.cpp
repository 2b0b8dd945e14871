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
#include "config/campaign.hpp"
#include "record/accepted_cycles.hpp"

namespace shaker::cli {
namespace {

using estimator::discrepancy::Campaign;
using estimator::discrepancy::Kind;
using estimator::discrepancy::Recording;
using estimator::discrepancy::recording_of;
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
  double time = 1.0, displacement = 1.0, excitation = 1.0, acceleration = 1.0, force = 1.0;
};

// A unit as campaign.json says it: a name that is known, or a label of the campaign's own with the
// size of one in the model's unit.
struct Unit {
  std::string label;
  std::optional<double> scale;
};

class Units {
 public:
  Units(const json& document, const std::string& where, const config::ModelSpec& model)
      : where_(where),
        length_(model.length_unit),
        metre_(metres(model.length_unit)),
        mass_(document.value("reference_mass", 0.0)),
        units_(document.value("units", json::object())) {}

  // What turns the file's numbers into the model's.
  Result<Factors> factors() const {
    if (!units_.is_object()) return invalid(where_, "/units is not an object");
    Factors factors;
    for (auto [name, factor] :
         {std::pair{"time", &factors.time}, std::pair{"displacement", &factors.displacement},
          std::pair{"excitation", &factors.excitation},
          std::pair{"acceleration", &factors.acceleration}, std::pair{"force", &factors.force}}) {
      // An accelerometer counts as the table's does unless it is said otherwise.
      const bool alike = name == std::string("acceleration") && !units_.contains(name);
      if (alike) {
        *factor = factors.excitation;
        continue;
      }
      const auto unit = unit_of(name);
      if (!unit) return unit.error();
      if (unit->scale) {
        *factor = *unit->scale;
        continue;
      }
      const auto found = factor_of(name, unit->label);
      if (!found) return found.error();
      *factor = *found;
    }
    return factors;
  }

 private:
  Result<Unit> unit_of(const std::string& name) const {
    const auto at = units_.find(name);
    if (at == units_.end()) return Unit{name == "time" ? "s" : "", {}};
    if (at->is_string()) return Unit{at->get<std::string>(), {}};
    const std::string place = "/units/" + name;
    if (!at->is_object())
      return invalid(where_, place + " is neither a unit nor an object of label and scale");
    const Unit unit{at->value("label", ""), at->value("scale", 0.0)};
    if (unit.label.empty() || !(*unit.scale > 0.0) || !std::isfinite(*unit.scale))
      return invalid(where_, place +
                                 " wants a label, and as scale the size of one of it in the "
                                 "model's unit, above 0");
    return unit;
  }

  Result<double> factor_of(const std::string& name, const std::string& unit) const {
    if (name == "time") return time(unit);
    const bool length = name == "displacement";
    const std::string wanted = length ? length_ : length_ + "/s^2";
    if (unit.empty() || unit == wanted) return 1.0;
    if (!length && (unit == "N" || unit == "kN")) return newtons(name, unit);
    const auto slash = unit.find("/s^2");
    std::optional<double> given;
    if (length)
      given = metres(unit);
    else if (slash != std::string::npos)
      given = metres(unit.substr(0, slash));
    else if (unit == "g")
      given = 9.80665;
    if (given && metre_) return *given / *metre_;
    return invalid(
        where_,
        fmt::format("/units/{} is \"{}\" and the model counts in \"{}\": these do not match; "
                    "say {{\"label\": \"{}\", \"scale\": ...}} with the size of one {} in {}",
                    name, unit, wanted, unit, unit, wanted));
  }

  Result<double> time(const std::string& unit) const {
    if (unit == "s") return 1.0;
    if (unit == "ms") return 1e-3;
    if (unit == "us") return 1e-6;
    return invalid(where_, fmt::format("/units/time is \"{}\"; it is s, ms or us", unit));
  }

  // Effects are forces over a mass.
  Result<double> newtons(const std::string& name, const std::string& unit) const {
    if (!(mass_ > 0.0) || !metre_)
      return invalid(where_, fmt::format("/units/{} is \"{}\", but the model counts forces over a "
                                         "mass, in {}/s^2: give /reference_mass in kg, above 0",
                                         name, unit, length_));
    return (unit == "kN" ? 1e3 : 1.0) / mass_ / *metre_;
  }

  const std::string& where_;
  std::string length_;
  std::optional<double> metre_;
  double mass_;
  json units_;
};

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
  return {{"t", "excitation", "displacement", "acceleration", "force"},
          {"t", "excitation", "displacement", "acceleration"},
          {"t", "excitation", "displacement", "force"},
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
  scale(recording.acceleration, factors.acceleration);
  scale(recording.force, factors.force);
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
  const auto factors = Units(document, where, model).factors();
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
    for (const Recording& other : campaign.runs) {
      if (other.name == run->name)
        return invalid(where, fmt::format("/runs/{}/name \"{}\" is the name of another run too; "
                                          "names tell them apart in the answer",
                                          i, run->name));
    }
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
  const double mass = config::reference_mass(row->spec_json);
  for (record::AcceptedCycles& run : *runs)
    add_cycles(campaign, recording_of(std::move(run)), mass);
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
