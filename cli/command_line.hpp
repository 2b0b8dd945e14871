// The command line of shakerctl: what its commands were given, and how a command is added. The
// commands themselves are in cli/commands/.
#pragma once

#include <functional>
#include <utility>

#include <CLI/CLI.hpp>

#include "cli/commands.hpp"

namespace shaker::cli {

struct Options {
  Common common;
  WatchOptions watch;
  RunOptions run;
  ProveOptions prove;
  EstimateOptions estimate;
  CompareOptions compare;
  DropOptions drop;
  ReproduceOptions reproduce;
  PlanCommand plan;
  MonteCarloCommand monte_carlo;
  ResponseOptions response;
  ExportOptions export_runs;
  ImportOptions import_campaign;
  DiagnoseCommandOptions diagnose;
  CampaignsOptions campaigns;
  ShowOptions show;
  NoteOptions note;
  CheckOptions check;
  VerifyOptions verify;
  ReportOptions report;
  PushOptions push;
  std::function<int()> action;
};

// Adds a command with the option --json. `action` runs after the command line has been read.
inline CLI::App* add(CLI::App& app, Options& o, const char* name, const char* help,
                     std::function<int()> action) {
  CLI::App* command = app.add_subcommand(name, help);
  command->add_flag("--json", o.common.json, "Print JSON instead of text");
  command->callback([&o, action = std::move(action)] { o.action = action; });
  return command;
}

inline void add_socket(CLI::App* command, Options& o) {
  command->add_option("--socket", o.common.socket, "Where the daemon listens")
      ->envname("SHAKERD_SOCKET")
      ->capture_default_str();
}

void add_file_commands(CLI::App& app, Options& o);
void add_drop_commands(CLI::App& app, Options& o);

}  // namespace shaker::cli
