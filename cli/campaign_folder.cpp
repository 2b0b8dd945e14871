#include "cli/campaign_folder.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "cli/campaign_place.hpp"
#include "cli/csv.hpp"
#include "cli/model_units.hpp"
#include "config/campaign.hpp"
#include "config/object_reader.hpp"
#include "record/accepted_cycles.hpp"

namespace shaker::cli {
namespace {

using config::Findings;
using config::Node;
using config::ObjectReader;
using estimator::diagnosis::Campaign;
using estimator::diagnosis::Kind;
using estimator::diagnosis::Recording;
using estimator::diagnosis::recording_of;
using estimator::diagnosis::Role;

constexpr double kLargestGravity = 1000.0;   // m/s^2, the same limit as for a model file
constexpr double kMassOfADynamometer = 1.0;  // kg; any would do
constexpr double kLargestNumber = 1e30;      // of a channel, so that fourth powers do not overflow

Error invalid(const std::string& where, const std::string& why) {
  return {ErrorKind::invalid, where + ": " + why};
}

void scale(std::vector<double>& column, double factor) {
  for (double& value : column)
    value *= factor;
}

constexpr const char* kChannels[] = {"t", "displacement", "excitation", "acceleration", "force"};

// The channels of a run, by what its files call them.
using ColumnNames = std::map<std::string, std::string>;

// "input": "current", or a list of them.
std::vector<std::string> read_inputs(ObjectReader& document, Findings& findings) {
  std::vector<std::string> inputs;
  const Node* node = document.member("input", false);
  if (node == nullptr) return inputs;
  const auto add = [&](const Node& name, const std::string& pointer) {
    const bool channel =
        std::find(std::begin(kChannels), std::end(kChannels), name.text) != std::end(kChannels);
    if (name.kind != Node::Kind::string || name.text.empty() || channel)
      findings.add(name, pointer,
                   fmt::format("{} is not the name of a further input of the damper, as "
                               "\"current\"",
                               name.shown()));
    inputs.push_back(name.text);
  };
  if (node->kind == Node::Kind::array)
    document.array("input", true, 1, add);
  else
    add(*node, document.at("input"));
  return inputs;
}

std::vector<std::vector<std::string>> columns_wanted(Kind kind, const ColumnNames& names) {
  std::vector<std::vector<std::string>> wanted = {
      {"t", "excitation", "displacement", "acceleration", "force"},
      {"t", "excitation", "displacement", "acceleration"},
      {"t", "excitation", "displacement", "force"},
      {"t", "excitation", "displacement"},
      {"t", "displacement"}};
  if (kind == Kind::imposed_motion) wanted = {{"t", "displacement", "force"}};
  // A channel that is mapped is meant to be read.
  std::erase_if(wanted, [&](const auto& channels) {
    return std::any_of(names.begin(), names.end(), [&](const auto& said) {
      const bool channel =
          std::find(std::begin(kChannels), std::end(kChannels), said.first) != std::end(kChannels);
      return channel && said.first != "t" &&
             (kind != Kind::imposed_motion || said.first == "force") &&
             std::find(channels.begin(), channels.end(), said.first) == channels.end();
    });
  });
  for (auto& channels : wanted) {
    for (std::string& channel : channels) {
      if (const auto said = names.find(channel); said != names.end()) channel = said->second;
    }
  }
  return wanted;
}

// "columns": {"t": "time_s", "displacement": "pos_mm"}
ColumnNames read_column_names(ObjectReader& document, const std::vector<std::string>& inputs,
                              Findings& findings) {
  ColumnNames names;
  const Node* node = document.member("columns", false);
  if (node == nullptr) return names;
  ObjectReader reader(*node, document.at("columns"), findings);
  std::vector<std::string> channels(std::begin(kChannels), std::end(kChannels));
  channels.insert(channels.end(), inputs.begin(), inputs.end());
  for (const std::string& channel : channels) {
    std::string name;
    if (reader.member(channel, false) == nullptr) continue;
    reader.required(channel, name);
    const bool twice = std::any_of(names.begin(), names.end(),
                                   [&](const auto& other) { return other.second == name; });
    if (twice) reader.complain(channel, fmt::format("column \"{}\" is another channel too", name));
    names[channel] = name;
  }
  reader.finish();
  return names;
}

// A run without its columns, and the file that holds them.
struct Described {
  Recording run;
  std::filesystem::path file;
};

Described describe(const Node& node, const std::string& pointer, Findings& findings) {
  static const std::string kinds[] = {"periodic", "imposed_motion", "transient"};
  static constexpr Kind kKinds[] = {Kind::periodic, Kind::imposed_motion, Kind::transient};
  static const std::string roles[] = {"fit", "held_out"};
  Described described;
  Recording& run = described.run;
  ObjectReader reader(node, pointer, findings);
  reader.required("name", run.name);
  run.kind = kKinds[reader.choice("kind", kinds, false).value_or(0)];
  const auto role = reader.choice("role", roles, false);
  run.role_given = role.has_value();
  run.role = role == 1U ? Role::held_out : Role::fit;
  reader.optional("frequency_hz", run.frequency_hz);
  reader.optional("amplitude", run.amplitude);
  config::read_condition(reader, findings, run.condition);
  described.file = run.name + ".csv";
  reader.optional("file", described.file);
  if (described.file.is_absolute() || described.file.string().find("..") != std::string::npos)
    reader.complain("file", fmt::format("file \"{}\" is not in the campaign's folder",
                                        described.file.string()));
  reader.finish();
  return described;
}

// How the columns of a campaign's files are read.
struct ColumnFormat {
  ModelUnits model;
  Factors factors;
  ColumnNames names;
  std::vector<std::string> inputs;

  std::string column_of(const std::string& channel) const {
    const auto said = names.find(channel);
    return said == names.end() ? channel : said->second;
  }
};

// Adds the inputs that the campaign does not state for this run: columns of its file.
void want_inputs(const Recording& run, const ColumnFormat& format,
                 std::vector<std::vector<std::string>>& wanted) {
  for (const std::string& input : format.inputs) {
    if (run.condition.values.contains(input)) continue;
    for (auto& columns : wanted)
      columns.push_back(format.column_of(input));
  }
}

// The mean of each input that was measured, in SI where its header states a known unit, and how it
// scatters about that.
void take_inputs(const CsvTable& table, const ColumnFormat& format, Recording& run) {
  for (const std::string& input : format.inputs) {
    const auto column = table.columns.find(format.column_of(input));
    if (column == table.columns.end() || column->second.empty()) continue;
    const auto header = table.units.find(column->first);
    const Unit plain;  // its scale is 1
    const Unit unit =
        header == table.units.end() ? plain : unit_called(header->second).value_or(plain);
    const auto count = static_cast<double>(column->second.size());
    double sum = 0.0, square = 0.0;
    for (const double value : column->second)
      sum += unit.to_si(value) / count;
    for (const double value : column->second)
      square += std::pow(unit.to_si(value) - sum, 2) / count;
    run.condition.values[input] = sum;
    run.input_scatter[input] = std::sqrt(square);
  }
}

Result<Recording> read_columns(Described described, const std::filesystem::path& folder,
                               const ColumnFormat& format) {
  Recording& run = described.run;
  const auto file = folder / described.file;
  auto wanted = columns_wanted(run.kind, format.names);
  want_inputs(run, format, wanted);
  auto table = read_csv(file, wanted, kLargestNumber);
  if (!table) return table.error();
  take_inputs(*table, format, run);
  const Factors& stated = format.factors;
  std::map<std::string, double> factor;
  for (const auto& [channel, column, of_campaign] :
       {std::tuple{"t", &run.t, stated.time},
        std::tuple{"displacement", &run.displacement, stated.displacement},
        std::tuple{"excitation", &run.excitation, stated.excitation},
        std::tuple{"acceleration", &run.acceleration, stated.acceleration},
        std::tuple{"force", &run.force, stated.force}}) {
    const std::string name = format.column_of(channel);
    auto found = column_factor(*table, file.string(), name, channel, format.model, of_campaign);
    if (!found) return found.error();
    // An accelerometer without a unit has that of the table's acceleration.
    if (column == &run.acceleration && !of_campaign && !table->units.contains(name))
      found = factor["excitation"];
    factor[channel] = *found;
    const auto values = table->columns.find(name);
    if (values == table->columns.end()) continue;
    scale(values->second, *found);
    *column = std::move(values->second);
  }
  run.amplitude *= factor[run.kind == Kind::imposed_motion ? "displacement" : "excitation"];
  return std::move(run);
}

void use_gravity(double given, config::ModelSpec& model, Campaign& campaign) {
  const auto metre = unit_called(model.length_unit, Dimension::length);
  const double in_model = given / (metre ? metre->scale : 1.0);
  if (std::fabs(in_model / model.gravity - 1.0) > 1e-6)
    campaign.warnings.push_back(
        fmt::format("the campaign's gravity, {:.6g} {}/s^2, is used instead "
                    "of the model's {:.6g}",
                    in_model, model.length_unit, model.gravity));
  model.gravity = in_model;
}

std::vector<Described> describe_runs(ObjectReader& document, Findings& findings) {
  std::vector<Described> runs;
  document.array("runs", true, 1, [&](const Node& node, const std::string& pointer) {
    Described next = describe(node, pointer, findings);
    if (std::any_of(runs.begin(), runs.end(),
                    [&](const Described& other) { return other.run.name == next.run.name; }))
      findings.add(node, pointer + "/name",
                   fmt::format("\"{}\" is the name of another run too; names tell them apart in "
                               "the answer",
                               next.run.name));
    if (std::any_of(runs.begin(), runs.end(), [&](const Described& other) {
          return other.run.name != next.run.name && other.file == next.file;
        }))
      findings.add(node, pointer + "/file",
                   fmt::format("\"{}\" is the file of another run too, and its noise would count "
                               "twice; leave one of the two out",
                               next.file.string()));
    runs.push_back(std::move(next));
  });
  return runs;
}

// On a dynamometer the motion is imposed, so that no mass matters.
bool all_imposed(const std::vector<Described>& runs) {
  return std::all_of(runs.begin(), runs.end(), [](const Described& described) {
    return described.run.kind == Kind::imposed_motion;
  });
}

// The unit in which the campaign states its displacement where that is an angle, else m.
std::string own_length_unit(const Node& root) {
  const Node* units = root.find("units");
  const Node* displacement = units == nullptr ? nullptr : units->find("displacement");
  const bool turns = displacement != nullptr && displacement->kind == Node::Kind::string &&
                     unit_called(displacement->text, Dimension::angle);
  return turns ? displacement->text : "m";
}

Result<Campaign> read_document(const Node& root, const std::filesystem::path& file,
                               config::ModelSpec& model) {
  Findings findings(file.string());
  ObjectReader document(root, "", findings);
  document.member("format", true);
  document.format("shaker-campaign/1");
  Campaign campaign;
  campaign.name = file.parent_path().filename().string();
  document.optional("name", campaign.name);
  std::optional<double> gravity;
  document.optional("gravity", gravity, config::at_least(0).at_most(kLargestGravity));
  ColumnFormat format;
  if (model.length_unit.empty()) model.length_unit = own_length_unit(root);
  format.model.length = model.length_unit;
  document.optional("reference_mass", format.model.mass, config::above(0).at_most(1e6));
  std::vector<Described> runs = describe_runs(document, findings);
  const bool massless = format.model.mass == 0.0 && all_imposed(runs);
  if (massless) format.model.mass = kMassOfADynamometer;
  format.factors = read_units(document, findings, format.model);
  format.inputs = campaign.inputs = read_inputs(document, findings);
  format.names = read_column_names(document, format.inputs, findings);
  document.finish();
  if (!findings.empty()) return findings.error();
  if (gravity) use_gravity(*gravity, model, campaign);
  for (Described& described : runs) {
    auto run = read_columns(std::move(described), file.parent_path(), format);
    if (!run) return run.error();
    campaign.runs.push_back(std::move(*run));
  }
  if (massless && format.factors.force)
    campaign.warnings.push_back(
        fmt::format("the campaign states no reference_mass: forces are counted over {:g} kg, so "
                    "that 1 m/s^2 in the answer is {:g} N",
                    kMassOfADynamometer, kMassOfADynamometer));
  return campaign;
}

Result<Campaign> read_folder(const std::filesystem::path& folder, config::ModelSpec& model) {
  const auto file = folder / "campaign.json";
  std::error_code trouble;
  if (!std::filesystem::exists(file, trouble))
    return invalid(
        file.string(),
        "there is no such file; a campaign's folder holds campaign.json and a CSV a run");
  return read_campaign_file(file, model);
}

Result<Campaign> read_database(const std::filesystem::path& file, const config::ModelSpec& model) {
  if (model.length_unit != "m")
    return invalid(
        file.string(),
        fmt::format("holds metres and the model counts in \"{}\"; give a model in metres",
                    model.length_unit));
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

Result<Campaign> read_campaign_file(const std::filesystem::path& file, config::ModelSpec& model) {
  const auto text = config::read_text(file);
  if (!text) return text.error();
  const auto root = config::parse_json(*text, file.string());
  if (!root) return root.error();
  return read_document(*root, file, model);
}

Result<Campaign> read_campaign(const std::filesystem::path& path, config::ModelSpec& model) {
  std::error_code trouble;
  if (std::filesystem::is_directory(path, trouble)) return read_folder(path, model);
  if (is_database(path)) return read_database(path, model);
  return invalid(path.string(), "is neither a campaign's folder nor a campaign database (.db)");
}

}  // namespace shaker::cli
