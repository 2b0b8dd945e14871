#include "cli/config_check.hpp"

#include <algorithm>
#include <charconv>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/clock.hpp"
#include "cli/campaign_folder.hpp"
#include "cli/campaign_summary.hpp"
#include "cli/dbc_check.hpp"
#include "cli/opened_campaign.hpp"
#include "config/campaign.hpp"
#include "config/json_tree.hpp"
#include "config/rig.hpp"
#include "estimator/model/model.hpp"
#include "protocol/can/database.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

namespace fs = std::filesystem;

void add_lines(std::vector<std::string>& lines, const std::string& text) {
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);)
    lines.push_back(line);
}

// "format" decides; without it, the keys that only one kind of file has.
std::string kind_of(const config::Node& root) {
  if (const auto* format = root.find("format");
      format && format->kind == config::Node::Kind::string) {
    for (const char* kind : {"rig", "model", "campaign"}) {
      if (format->text.starts_with(fmt::format("shaker-{}/", kind))) return kind;
    }
  }
  if (root.find("exciter") || root.find("sensors")) return "rig";
  if (root.find("runs")) return "campaign";
  if (root.find("effects")) return "model";
  return {};
}

constexpr double kShortColumn = 0.01;  // m; no aircraft damper has a shorter one

// The estimator refuses cycles at which 1 - theta3 u <= 0, because there is no force; this
// check finds such a start value earlier. `stroke_max`: the rig's limit, m, or 0 when no rig is
// known.
void check_gas_column(const config::ModelSpec& spec, double stroke_max, CheckReport& report) {
  for (const config::EffectSpec& effect : spec.effects) {
    const auto found = effect.parameters.find("theta3");
    if (effect.effect != "gas_spring" || spec.length_unit != "m" ||
        found == effect.parameters.end() || !found->second.start || !(*found->second.start > 0.0)) {
      continue;
    }
    const double column = 1.0 / *found->second.start;
    if (column >= std::max(kShortColumn, stroke_max / 2.0)) continue;
    report.warnings.push_back(fmt::format(
        "theta3 starts at {:g} 1/m: the gas column is only {:.3g} m long, and 1 - theta3 u is not "
        "above 0 at larger strokes{}; is it in 1/m?",
        *found->second.start, column,
        stroke_max > 0.0 ? fmt::format(" (the rig allows {:g} m)", stroke_max) : ""));
  }
}

void check_model(const config::ModelSpec& spec, CheckReport& report, double stroke_max = 0.0) {
  check_gas_column(spec, stroke_max, report);
  try {
    const estimator::Model model(spec);
    std::vector<std::string> names;
    for (const config::EffectSpec& effect : spec.effects)
      names.push_back(effect.effect);
    report.facts.push_back(fmt::format("model {}: {}", spec.name, fmt::join(names, " + ")));
    for (const estimator::ModelParameter& p : model.parameters()) {
      report.facts.push_back(fmt::format("  {} [{}]: start {:.6g}, {:.6g} .. {:.6g}{}", p.name,
                                         p.unit, p.start, p.lower, p.upper,
                                         p.fixed ? ", fixed" : ""));
    }
  } catch (const std::invalid_argument& error) {
    report.errors.emplace_back(error.what());
  }
}

class RigChecker {
 public:
  RigChecker(const config::RigConfig& rig, CheckReport& report) : rig_(rig), report_(report) {}

  void check() {
    std::visit([this](const auto& device) { exciter(device); }, rig_.exciter.device);
    for (const config::SensorConfig& each : rig_.sensors) {
      std::visit([this](const auto& device) { sensor(device); }, each);
    }
    const config::Limits& l = rig_.limits;
    fact("limits: stroke {} .. {} m, rate {} m/s, excitation {} m/s^2, {} .. {} Hz", l.stroke_min_m,
         l.stroke_max_m, l.stroke_rate_max_m_s, l.excitation_max_m_s2, l.frequency_min_hz,
         l.frequency_max_hz);
    detectors();
    calibrations();
    if (!rig_.model.empty()) default_model();
  }

 private:
  void calibrations() {
    const std::string today = format_utc(RealClock().utc()).substr(0, 10);
    for (const auto& [channel, calibration] : rig_.calibration) {
      const std::string sensor =
          fmt::format("{} sensor {}", protocol::name(channel), calibration.serial);
      fact("{}: calibrated {}, due {}, uncertainty {:g} {}", sensor, calibration.date,
           calibration.due, calibration.uncertainty, calibration.unit);
      if (today > calibration.due) report_.warnings.push_back(sensor + ": calibration is overdue");
    }
  }

  template <class... Args>
  void fact(fmt::format_string<Args...> format, Args&&... args) {
    report_.facts.push_back(fmt::format(format, std::forward<Args>(args)...));
  }

  // The actions of the limits: a limit without an action protects nothing.
  void detectors() {
    std::vector<std::string_view> ending, telling;
    for (const config::Guard& guard : config::guards(rig_.limits)) {
      std::string_view what = guard.key;
      what.remove_suffix(std::string_view("_action").size());
      if (!guard.on) continue;
      if (config::ends_motion(guard.action)) {
        ending.push_back(what);
      } else if (guard.action != config::Action::none) {
        telling.push_back(what);
      } else {
        report_.warnings.push_back(
            fmt::format("{} is \"none\": the daemon does not watch this limit", guard.key));
      }
    }
    if (!ending.empty()) fact("limits that end the motion: {}", fmt::join(ending, ", "));
    if (!telling.empty()) fact("limits that are only told or hold: {}", fmt::join(telling, ", "));
    if (rig_.unprotected) {
      report_.warnings.emplace_back("unprotected: no limit of this rig ends the motion");
    }
  }

  static std::string link(const config::ModbusLink& link) {
    if (const auto* tcp = std::get_if<config::ModbusTcp>(&link.transport)) {
      return fmt::format("Modbus TCP {}:{} unit {}", tcp->host, tcp->port, link.unit_id);
    }
    const auto& rtu = std::get<config::ModbusRtu>(link.transport);
    return fmt::format("Modbus RTU {} {} baud 8{}{} unit {}", rtu.device, rtu.baud, rtu.parity,
                       rtu.stop_bits, link.unit_id);
  }

  void exciter(const config::ModbusExciter& e) {
    fact("exciter: {}, {} registers", link(e.link), e.registers.size());
    if (!e.registers.contains("heartbeat_timeout")) {
      report_.warnings.emplace_back(
          "the exciter has no register \"heartbeat_timeout\": that it stops "
          "by itself when the link is lost cannot be read back");
    }
  }
  void exciter(const config::CanExciter& e) {
    fact("exciter: CAN {}, {} every {} s", e.interface, e.setpoint_message, e.period_s);
    const auto database = dbc(e.dbc);
    for (const char* name : {"frequency", "amplitude", "enable", "ramp", "heartbeat"}) {
      expect_signal(database, e.dbc, e.setpoint_message, name);
    }
    for (const char* name : {"status", "fault"}) {
      expect_signal(database, e.dbc, e.status_message, name);
    }
  }
  void exciter(const config::SimulatedExciter&) { fact("exciter: simulated"); }
  void exciter(const config::ReplayExciter&) { fact("exciter: none (replay)"); }

  void sensor(const config::CanSensor& s) {
    fact("sensor: CAN {}, {} signals of {}", s.interface, s.signals.size(), s.dbc.string());
    const auto database = dbc(s.dbc);
    for (const auto& each : s.signals)
      expect_signal(database, s.dbc, each.message, each.signal);
  }
  void sensor(const config::ModbusSensor& s) {
    fact("sensor: {}, {} channels at {} Hz{}", link(s.link), s.registers.size(), s.rate_hz,
         s.timestamp ? ", stamped by the device" : "");
  }
  void sensor(const config::SimulatedSensor& s) {
    fact("sensor: simulated {} at {} Hz", s.plant, s.rate_hz);
  }
  void sensor(const config::ReplaySensor& s) {
    fact("sensor: replay of {}", s.file.string());
    if (!fs::exists(rig_.directory / s.file)) {
      report_.warnings.push_back(
          fmt::format("{}: there is no such file yet", (rig_.directory / s.file).string()));
    }
    if (s.dbc.empty()) return;
    const auto database = dbc(s.dbc);
    for (const auto& each : s.signals)
      expect_signal(database, s.dbc, each.message, each.signal);
  }

  std::optional<protocol::can::Database> dbc(const fs::path& file) {
    const auto path = rig_.directory / file;
    const auto text = config::read_text(path);
    auto database = text ? protocol::can::parse_dbc(*text, path.string())
                         : Result<protocol::can::Database>(text.error());
    if (database) return std::move(*database);
    report_.errors.push_back(database.error().what);
    return std::nullopt;
  }

  void expect_signal(const std::optional<protocol::can::Database>& database, const fs::path& dbc,
                     const std::string& message, const std::string& signal) {
    if (!database) return;
    const protocol::can::Message* found = database->find(message);
    if (!found) {
      std::vector<std::string> names;
      for (const auto& each : database->messages)
        names.push_back(each.name);
      report_.errors.push_back(fmt::format("{}: there is no message \"{}\"; there are {}",
                                           dbc.string(), message, fmt::join(names, ", ")));
    } else if (!found->find(signal)) {
      std::vector<std::string> names;
      for (const auto& each : found->signals)
        names.push_back(each.name);
      report_.errors.push_back(fmt::format("{}: message {} has no signal \"{}\"; it has {}",
                                           dbc.string(), message, signal, fmt::join(names, ", ")));
    }
  }

  void default_model() {
    const auto model = config::load_model(rig_.directory / rig_.model);
    if (!model) {
      add_lines(report_.errors, model.error().what);
    } else {
      check_model(*model, report_, rig_.limits.stroke_max_m);
    }
  }

  const config::RigConfig& rig_;
  CheckReport& report_;
};

void check_against(const config::CampaignSpec& campaign, const fs::path& file,
                   CheckReport& report) {
  const auto rig = config::load_rig(file);
  if (!rig) return report.bad_rig = file.string(), add_lines(report.errors, rig.error().what);
  const config::Limits& l = rig->limits;
  check_gas_column(campaign.model, l.stroke_max_m, report);
  for (const config::RunSpec& run : campaign.runs) {
    if (run.frequency_hz < l.frequency_min_hz || run.frequency_hz > l.frequency_max_hz) {
      report.errors.push_back(fmt::format("run {}: {} Hz is outside of the rig's {} .. {} Hz",
                                          run.name, run.frequency_hz, l.frequency_min_hz,
                                          l.frequency_max_hz));
    }
    if (run.amplitude > l.excitation_max_m_s2) {
      report.errors.push_back(fmt::format("run {}: {} m/s^2 is above the rig's {} m/s^2", run.name,
                                          run.amplitude, l.excitation_max_m_s2));
    }
  }
}

// The estimator numbers the effects from the top of the model. In a campaign file that contains
// its model the place is "/model/effects/N", and the line is known here.
void place_in_campaign(const config::Node& root, const std::string& file,
                       std::vector<std::string>& errors) {
  const config::Node* model = root.find("model");
  const config::Node* effects = model != nullptr ? model->find("effects") : nullptr;
  if (effects == nullptr) return;
  const std::string head = file + ": /effects/";
  for (std::string& error : errors) {
    if (!error.starts_with(head)) continue;
    std::size_t index = effects->elements.size();
    std::from_chars(error.data() + head.size(), error.data() + error.size(), index);
    const int line = index < effects->elements.size() ? effects->elements[index].line : model->line;
    error = fmt::format("{}:{}: /model/effects/{}", file, line, error.substr(head.size()));
  }
}

void check_campaign(const fs::path& file, const config::Node& root, const fs::path& rig,
                    CheckReport& report) {
  const auto campaign = config::load_campaign(file);
  if (!campaign) return add_lines(report.errors, campaign.error().what);
  report.facts.push_back(fmt::format("campaign {}: {}", campaign->name,
                                     report::counted(campaign->runs.size(), "run")));
  for (const config::RunSpec& run : campaign->runs) {
    report.facts.push_back(fmt::format("  {}: {:.6g} Hz, {:.6g} m/s^2, {} cycles ({:.0f} s)",
                                       run.name, run.frequency_hz, run.amplitude, run.cycles,
                                       run.cycles / run.frequency_hz));
  }
  const std::size_t before = report.warnings.size();
  check_model(campaign->model, report);
  place_in_campaign(root, file.string(), report.errors);
  if (!rig.empty()) report.warnings.resize(before);  // repeated below, with the rig's limit
  if (!rig.empty()) check_against(*campaign, rig, report);
}

// A campaign.json with recorded runs has keys that no other campaign file has.
bool recorded(const config::Node& root) {
  const config::Node* runs = root.find("runs");
  const auto own = [](const config::Node& run) {
    return run.find("file") != nullptr || run.find("kind") != nullptr ||
           run.find("role") != nullptr;
  };
  return root.find("model") == nullptr &&
         (root.find("units") != nullptr || root.find("gravity") != nullptr ||
          (runs != nullptr && std::any_of(runs->elements.begin(), runs->elements.end(), own)));
}

void check_recorded(const fs::path& file, CheckReport& report) {
  using estimator::diagnosis::Kind;
  using estimator::diagnosis::Role;
  config::ModelSpec any;    // the model of the later diagnosis is not known here
  any.length_unit.clear();  // an angle's, or m
  const auto campaign = read_campaign_file(file, any);
  if (!campaign) return add_lines(report.errors, campaign.error().what);
  report.facts.push_back(fmt::format("recorded campaign {}: {}", campaign->name,
                                     report::counted(campaign->runs.size(), "run")));
  for (const auto& run : campaign->runs) {
    const double length = run.t.empty() ? 0.0 : run.t.back() - run.t.front();
    const std::string unit =
        run.kind == Kind::imposed_motion ? any.length_unit : any.length_unit + "/s^2";
    // A record without a period has no frequency and need not state an amplitude.
    const std::string driven = run.frequency_hz > 0.0 ? fmt::format("{:g} Hz", run.frequency_hz)
                               : run.kind == Kind::imposed_motion
                                   ? "imposed motion without a period"
                                   : "transient";
    const std::string size =
        run.amplitude > 0.0 ? fmt::format(", {:g} {}", run.amplitude, unit) : std::string();
    report.facts.push_back(fmt::format("  {}: {}{}, {} samples in {:.4g} s{}", run.name, driven,
                                       size, run.t.size(), length,
                                       run.role == Role::held_out ? ", held out" : ""));
  }
}

void check_database(const fs::path& file, CheckReport& report) {
  report.kind = "campaign database";
  const auto summary = summarise(file, true);
  if (!summary) return add_lines(report.errors, summary.error().what);
  report.facts.push_back(fmt::format("campaign {}: {}", summary->row.name,
                                     report::counted(summary->runs.size(), "run")));
  int accepted = 0;
  for (const RunSummary& run : summary->runs) {
    report.facts.push_back(fmt::format("  {}: {:g} Hz, {:g} m/s^2, {} accepted cycles",
                                       run.row.name, run.row.frequency_hz, run.row.amplitude,
                                       run.accepted));
    accepted += static_cast<int>(run.accepted);
  }
  if (accepted == 0) report.warnings.push_back("it holds no accepted cycle");
}

}  // namespace

CheckReport check_file(const fs::path& path, const fs::path& rig_file) {
  const bool folder = place_of(path) == Place::folder;
  const fs::path file = folder ? path / "campaign.json" : path;
  CheckReport report;
  if (place_of(file) == Place::database) {
    check_database(file, report);
    return report;
  }
  const auto text = config::read_text(file);
  if (!text) return report.errors.push_back(text.error().what), report;
  if (file.extension() == ".dbc") {
    report.kind = "DBC";
    check_dbc(file, *text, rig_file, report);
    return report;
  }
  const auto root = config::parse_json(*text, file.string());
  if (!root) return report.errors.push_back(root.error().what), report;
  report.kind = kind_of(*root);
  const bool holds_runs = recorded(*root) || (folder && root->find("model") == nullptr);
  if (report.kind == "campaign" && holds_runs) {
    check_recorded(file, report);
  } else if (report.kind == "campaign") {
    check_campaign(file, *root, rig_file, report);
  } else if (report.kind == "model") {
    const auto model = config::load_model(file);
    if (model) {
      check_model(*model, report);
    } else {
      add_lines(report.errors, model.error().what);
    }
  } else if (report.kind == "rig") {
    const auto rig = config::load_rig(file);
    if (rig) {
      RigChecker(*rig, report).check();
    } else {
      add_lines(report.errors, rig.error().what);
    }
  } else {
    report.errors.push_back(fmt::format(
        "{}: neither a rig (\"exciter\", \"sensors\"), a model (\"effects\") nor a campaign "
        "(\"runs\")",
        file.string()));
  }
  return report;
}

}  // namespace shaker::cli
