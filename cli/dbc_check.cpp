#include "cli/dbc_check.hpp"

#include <map>
#include <set>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "config/rig.hpp"
#include "protocol/can/database.hpp"

namespace shaker::cli {
namespace {

namespace fs = std::filesystem;
using protocol::can::Database;
using protocol::can::Message;
using protocol::can::Signal;

// The signals that a rig uses from this file, by message.
using Uses = std::map<std::string, std::set<std::string>>;

Uses uses_of(const config::RigConfig& rig, const fs::path& file) {
  Uses uses;
  const auto same = [&](const fs::path& dbc) {
    std::error_code none;
    return fs::equivalent(rig.directory / dbc, file, none);
  };
  const auto add = [&](const std::vector<config::CanSignal>& signals) {
    for (const config::CanSignal& each : signals)
      uses[each.message].insert(each.signal);
  };
  for (const config::SensorConfig& sensor : rig.sensors) {
    if (const auto* can = std::get_if<config::CanSensor>(&sensor); can && same(can->dbc))
      add(can->signals);
    const auto* replay = std::get_if<config::ReplaySensor>(&sensor);
    if (replay && !replay->dbc.empty() && same(replay->dbc)) add(replay->signals);
  }
  if (const auto* can = std::get_if<config::CanExciter>(&rig.exciter.device);
      can && same(can->dbc)) {
    uses[can->setpoint_message].insert({"frequency", "amplitude", "enable"});
    uses[can->status_message].insert({"status", "fault"});
  }
  return uses;
}

std::string line_of(const Signal& signal, bool used) {
  std::string text =
      fmt::format("  {}: {} bits from {}", signal.name, signal.length, signal.start_bit);
  if (!signal.unit.empty()) text += fmt::format(", {}", signal.unit);
  if (signal.minimum != 0.0 || signal.maximum != 0.0)
    text += fmt::format(", {:g} to {:g}", signal.minimum, signal.maximum);
  if (signal.multiplexor) text += ", selects others";
  if (signal.multiplexed) text += ", only where it is selected";
  return text + (used ? "  <- used by the rig" : "");
}

void complain_of_missing(const Database& database, const Uses& uses, CheckReport& report) {
  for (const auto& [name, signals] : uses) {
    const Message* message = database.find(name);
    if (message == nullptr) {
      report.errors.push_back(fmt::format("{}: the rig asks for message {}, which is not there",
                                          database.origin, name));
      continue;
    }
    for (const std::string& signal : signals) {
      if (message->find(signal) == nullptr) {
        report.errors.push_back(
            fmt::format("{}: message {} has no signal {}, which the rig asks for", database.origin,
                        name, signal));
      }
    }
  }
}

}  // namespace

void check_dbc(const fs::path& file, const std::string& text, const fs::path& rig,
               CheckReport& report) {
  const auto database = protocol::can::parse_dbc(text, file.string());
  if (!database) return report.errors.push_back(database.error().what);
  Uses uses;
  if (!rig.empty()) {
    const auto read = config::load_rig(rig);
    if (!read) return report.bad_rig = rig.string(), report.errors.push_back(read.error().what);
    uses = uses_of(*read, file);
    if (uses.empty())
      report.warnings.push_back(fmt::format("{} uses nothing of this file", rig.string()));
  }
  for (const Message& message : database->messages) {
    report.facts.push_back(fmt::format(
        "message {} (0x{:X}{}), {} bytes{}", message.name, message.id,
        message.extended ? " extended" : "", message.size,
        message.cycle_time_s ? fmt::format(", every {:g} s", *message.cycle_time_s) : ""));
    const auto used = uses.find(message.name);
    for (const Signal& signal : message.signals) {
      report.facts.push_back(
          line_of(signal, used != uses.end() && used->second.contains(signal.name)));
      if (!signal.unit.empty() && !unit_called(signal.unit))
        report.warnings.push_back(
            fmt::format("{}.{}: \"{}\" is no unit that the program converts; "
                        "give the signal a scale in the rig file",
                        message.name, signal.name, signal.unit));
    }
  }
  complain_of_missing(*database, uses, report);
}

}  // namespace shaker::cli
