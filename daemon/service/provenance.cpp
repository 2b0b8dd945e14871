#include "daemon/service/provenance.hpp"

#include <array>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sqlite3.h>
#include <sys/utsname.h>
#include <unistd.h>

#include "config/json_tree.hpp"
#include "daemon/safety/detectors.hpp"
#include "daemon/service/options.hpp"

namespace shaker::daemon {
namespace {

using Json = nlohmann::ordered_json;

record::Fact fact_of_file(const char* kind, const std::filesystem::path& file) {
  const auto text = config::read_text(file);
  return {kind, file.string(), text ? *text : "not read: " + text.error().what};
}

std::set<std::filesystem::path> dbc_files(const config::RigConfig& rig) {
  std::set<std::filesystem::path> files;
  const auto add = [&](const std::filesystem::path& dbc) {
    if (!dbc.empty()) files.insert(rig.directory / dbc);
  };
  if (const auto* can = std::get_if<config::CanExciter>(&rig.exciter.device)) add(can->dbc);
  for (const config::SensorConfig& sensor : rig.sensors) {
    if (const auto* can = std::get_if<config::CanSensor>(&sensor)) add(can->dbc);
    if (const auto* replay = std::get_if<config::ReplaySensor>(&sensor)) add(replay->dbc);
  }
  return files;
}

// As they are in force, with the defaults of what the rig file leaves out.
std::string limits_text(const config::Limits& l) {
  const Json limits = {{"stroke_min_m", l.stroke_min_m},
                       {"stroke_max_m", l.stroke_max_m},
                       {"stroke_action", name(l.stroke_action)},
                       {"stroke_rate_max_m_s", l.stroke_rate_max_m_s},
                       {"stroke_rate_action", name(l.stroke_rate_action)},
                       {"excitation_max_m_s2", l.excitation_max_m_s2},
                       {"excitation_action", name(l.excitation_action)},
                       {"frequency_min_hz", l.frequency_min_hz},
                       {"frequency_max_hz", l.frequency_max_hz},
                       {"stale_s", l.stale_s},
                       {"stale_action", name(l.stale_action)},
                       {"command_error_fraction", l.command_error_fraction},
                       {"command_error_action", name(l.command_error_action)},
                       {"response_change_fraction", l.response_change_fraction},
                       {"response_change_action", name(l.response_change_action)},
                       {"under_peak_fraction", l.under_peak_fraction},
                       {"under_peak_action", name(l.under_peak_action)},
                       {"trim_max_fraction", l.trim_max_fraction},
                       {"engine_stall_s", l.engine_stall_s},
                       {"acquisition_stall_s", l.acquisition_stall_s},
                       {"recorder_stall_s", l.recorder_stall_s}};
  return limits.dump();
}

std::string calibration_text(const config::Calibration& calibration) {
  const Json entry = {{"sensor", calibration.sensor},
                      {"serial", calibration.serial},
                      {"date", calibration.date},
                      {"due", calibration.due},
                      {"uncertainty", calibration.uncertainty},
                      {"unit", calibration.unit}};
  return entry.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void add_programs(std::vector<record::Fact>& facts) {
  facts.push_back({"program", "shakerd", program_version()});
  facts.push_back({"program", "compiler", __VERSION__});
  facts.push_back({"program", "sqlite", ::sqlite3_libversion()});
  utsname system{};
  if (::uname(&system) == 0) {
    facts.push_back({"program", "kernel",
                     fmt::format("{} {} {}", system.sysname, system.release, system.machine)});
  }
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) == 0)
    facts.push_back({"host", "name", host.data()});
}

}  // namespace

std::vector<record::Fact> facts_of_rig(const config::RigConfig& rig,
                                       const std::filesystem::path& file) {
  std::vector<record::Fact> facts = {{"rig file", file.string(), rig.text}};
  if (!rig.model.empty()) facts.push_back(fact_of_file("model file", rig.directory / rig.model));
  for (const auto& dbc : dbc_files(rig))
    facts.push_back(fact_of_file("DBC file", dbc));
  facts.push_back({"limits", "in force", limits_text(rig.limits)});
  for (const auto& [channel, calibration] : rig.calibration) {
    facts.push_back(
        {"sensor", std::string(protocol::name(channel)), calibration_text(calibration)});
  }
  add_programs(facts);
  return facts;
}

}  // namespace shaker::daemon
