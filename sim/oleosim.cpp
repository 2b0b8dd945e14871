// oleosim: the virtual rig as a program. It serves Modbus and CAN in real time, or records a
// campaign into a folder.
#include <csignal>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/signalfd.h>

#include "sim/campaign_recorder.hpp"
#include "sim/instruments.hpp"
#include "sim/plant.hpp"
#include "sim/rig_server.hpp"

namespace {

using namespace shaker;
using sim::RigServer;

struct Options {
  sim::RigOptions rig;
  std::vector<std::string> parameters, faults;
  std::string address = "127.0.0.1", pty, can, status_file, truth_file;
  int port = -1;
  std::string record;
  std::vector<std::string> runs, held_out;
  double cycles = 14.0;
  bool can_auxiliary = false;
};

std::string parameter_help() {
  std::string text = "Parameters (--param NAME=VALUE):\n";
  const auto list = [&](const auto& rows) {
    for (const auto& p : rows) {
      text += fmt::format("  {:24} {:12} {:<10} {}\n", p.name, p.unit, p.standard, p.meaning);
    }
  };
  for (const auto& plant : sim::plant_table()) {
    text += fmt::format("\nplant {}: {}\n", plant.name, plant.meaning);
    list(sim::parameters_of(plant));
  }
  text += "\ninstruments, with every plant:\n";
  list(sim::instrument_parameters());
  text += "\nFaults (--fault NAME@SECONDS, or holding register 11):";
  for (int i = 0; i < sim::kFaultCount; ++i) {
    text += fmt::format("{} {} {}", i ? "," : "", i, sim::name(static_cast<sim::Fault>(i)));
  }
  text +=
      "\n\nAuxiliary quantities, in the registers from 14 on and with --can-auxiliary, in order:\n";
  for (const auto& row : sim::auxiliary_table())
    text += fmt::format("  {:24} {:12} {}\n", row.name, row.unit, row.meaning);
  return text + "\nRegister map, CAN frames: sim/README.md, sim/oleosim.dbc";
}

void declare(CLI::App& app, Options& o) {
  app.footer(parameter_help);
  app.add_option("--port", o.port,
                 "Modbus TCP port; 0: any free one (printed); default 1502 if no --pty")
      ->check(CLI::Range(0, 65535));
  app.add_option("--bind", o.address, "address to listen on")
      ->check(CLI::ValidIPV4)
      ->capture_default_str();
  app.add_option("--pty", o.pty, "Modbus RTU on a pseudo-terminal, LINK being made to point to it");
  app.add_option("--can", o.can, "CAN interface for the sensors' frames, e.g. vcan0");
  app.add_flag("--can-auxiliary", o.can_auxiliary,
               "and the auxiliary quantities' frames, every 10th sample");
  app.add_option("--plant", o.rig.plant, "what is on the table")->capture_default_str();
  app.add_option("--param", o.parameters, "NAME=VALUE, repeatable");
  app.add_option("--rate", o.rig.sample_rate_hz, "samples a second")->capture_default_str();
  app.add_option("--noise", o.rig.noise_m, "standard deviation of the stroke, m")
      ->capture_default_str();
  app.add_option("--excitation-noise", o.rig.noise_m_s2, "of the table's acceleration, m/s^2")
      ->capture_default_str();
  app.add_option("--quantum", o.rig.quantum_m, "step of the stroke, m")->capture_default_str();
  app.add_option("--excitation-quantum", o.rig.quantum_m_s2, "step of the acceleration, m/s^2")
      ->capture_default_str();
  app.add_option("--clock-ppm", o.rig.clock_offset_ppm, "the rig's clock runs fast by so much")
      ->capture_default_str();
  app.add_option("--jitter", o.rig.jitter_fraction, "samples arrive up to so much of a sample late")
      ->capture_default_str();
  app.add_option("--dropout", o.rig.dropout_fraction, "share of the samples that is lost")
      ->capture_default_str();
  app.add_option("--heartbeat-timeout", o.rig.heartbeat_timeout_s,
                 "the controller's own dead-man, s; 0: none")
      ->capture_default_str();
  app.add_option("--seed", o.rig.seed, "of the noise")->capture_default_str();
  app.add_option("--fault", o.faults, "NAME@SECONDS after the start, repeatable");
  app.add_option("--status-file", o.status_file, "written as JSON once the rig serves");
  app.add_option(
      "--record", o.record,
      "no wires: record --run after --run into this folder, as fast as it goes, and leave");
  app.add_option("--run", o.runs, "FREQUENCY:AMPLITUDE of a run, Hz and m/s^2, repeatable");
  app.add_option("--held-out", o.held_out, "a run that is recorded but not to be fitted");
  app.add_option("--cycles", o.cycles, "of each run, after its transient")->capture_default_str();
  app.add_option("--truth-file", o.truth_file, "written with the true parameters as JSON");
}

double number(const std::string& text, const std::string& place) {
  std::size_t used = 0;
  double value = 0.0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || used != text.size()) {
    throw std::invalid_argument(fmt::format("{}: '{}' is no number", place, text));
  }
  return value;
}

std::map<std::string, double> read_parameters(const std::vector<std::string>& given) {
  std::map<std::string, double> values;
  for (const auto& text : given) {
    const auto equals = text.find('=');
    if (equals == std::string::npos) {
      throw std::invalid_argument(fmt::format("--param {}: write NAME=VALUE", text));
    }
    values[text.substr(0, equals)] = number(text.substr(equals + 1), "--param " + text);
  }
  return values;
}

std::vector<sim::ScriptedFault> read_script(const std::vector<std::string>& given) {
  std::vector<sim::ScriptedFault> script;
  for (const auto& text : given) {
    const auto at = text.find('@');
    const auto fault = sim::fault_from_name(text.substr(0, at));
    if (!fault || at == std::string::npos) {
      throw std::invalid_argument(
          fmt::format("--fault {}: write NAME@SECONDS, with a name that --help lists", text));
    }
    script.push_back({*fault, number(text.substr(at + 1), "--fault " + text)});
  }
  return script;
}

void write_json(const std::string& path, const nlohmann::json& document) {
  if (path.empty()) return;
  std::ofstream file(path);
  file << document.dump(2) << '\n';
  file.close();
  if (!file) throw std::runtime_error(fmt::format("{}: cannot be written", path));
}

template <class T>
void must(Result<T> result) {
  if (!result.ok()) throw std::runtime_error(result.error().what);
}

void open_wires(const Options& o, RigServer& server) {
  const int port = o.port >= 0 ? o.port : 1502;
  if (o.port >= 0 || o.pty.empty()) must(server.open_tcp(o.address, port));
  if (!o.pty.empty()) must(server.open_pty(o.pty));
  if (!o.can.empty()) must(server.open_can(o.can, o.can_auxiliary));
}

// Prints one line on stdout and writes the status file, so that a script can wait for the rig.
void announce(const Options& o, const RigServer& server) {
  nlohmann::json status = {{"ready", true}};
  std::string line = "ready";
  for (const auto& face : server.modbus()) {
    if (face->port() > 0) {
      status["port"] = face->port();
      line += fmt::format(" port={}", face->port());
    } else {
      status["pty"] = face->place();
      line += fmt::format(" pty={}", face->place());
    }
  }
  if (!o.can.empty()) {
    status["can"] = o.can;
    line += fmt::format(" can={}", o.can);
  }
  write_json(o.status_file, status);
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

void write_truth(const Options& o, const std::map<std::string, double>& parameters) {
  write_json(o.truth_file, {{"plant", o.rig.plant},
                            {"parameters", parameters},
                            {"sample_rate_hz", o.rig.sample_rate_hz},
                            {"noise_m", o.rig.noise_m},
                            {"noise_m_s2", o.rig.noise_m_s2},
                            {"clock_offset_ppm", o.rig.clock_offset_ppm}});
}

void add_runs(const std::vector<std::string>& given, bool held_out,
              std::vector<sim::RecordedRun>& runs) {
  for (const auto& text : given) {
    const auto colon = text.find(':');
    if (colon == std::string::npos) {
      throw std::invalid_argument(
          fmt::format("'{}': write a run as FREQUENCY:AMPLITUDE, for example 2:3", text));
    }
    runs.push_back({fmt::format("r{:02}", runs.size() + 1), number(text.substr(0, colon), text),
                    number(text.substr(colon + 1), text), held_out});
  }
}

int record(Options& o) {
  o.rig.parameters = read_parameters(o.parameters);
  sim::CampaignRecording campaign;
  campaign.rig = o.rig;
  campaign.cycles = o.cycles;
  add_runs(o.runs, false, campaign.runs);
  add_runs(o.held_out, true, campaign.runs);
  if (campaign.runs.empty()) throw std::invalid_argument("--record needs a --run, as in --run 2:3");
  write_campaign(campaign, o.record);
  write_truth(o, sim::VirtualRig(o.rig, Nanoseconds{0}).true_parameters());
  fmt::print("{} runs of {} cycles are in {}\n", campaign.runs.size(), o.cycles, o.record);
  return 0;
}

int serve(Options& o) {
  sigset_t stops;
  sigemptyset(&stops);
  sigaddset(&stops, SIGTERM);
  sigaddset(&stops, SIGINT);
  sigprocmask(SIG_BLOCK, &stops, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  const UniqueFd stop(signalfd(-1, &stops, SFD_CLOEXEC));

  o.rig.parameters = read_parameters(o.parameters);
  for (const auto& row : sim::auxiliary_table())
    o.rig.auxiliary.emplace_back(row.name);
  RigServer server(o.rig, read_script(o.faults));
  open_wires(o, server);
  write_truth(o, server.rig().true_parameters());
  announce(o, server);
  server.run(stop.get());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "A landing-gear damper on a shaker table that is not there: Modbus and CAN, in real time.",
      "oleosim");
  Options options;
  declare(app, options);
  CLI11_PARSE(app, argc, argv);
  try {
    return options.record.empty() ? serve(options) : record(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "oleosim: {}\n", error.what());
    return 1;
  }
}
