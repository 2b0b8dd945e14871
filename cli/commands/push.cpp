// push: campaign databases into the tables of a PostgreSQL server.
#include <cstdio>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/campaign_summary.hpp"
#include "cli/commands.hpp"
#include "cli/push/campaign_push.hpp"
#include "cli/push/layout.hpp"

namespace shaker::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kKept =
    "Nothing is lost: the campaigns stay in their files. The same command sends the rest when the "
    "server is back";

// Databases by their names, folders by what is in them.
Result<std::vector<std::filesystem::path>> files_to_push(const Common& common,
                                                         const PushOptions& options) {
  std::vector<std::filesystem::path> files;
  for (const auto& campaign : options.campaigns) {
    std::error_code none;  // what is not there is told by the reader
    if (!std::filesystem::is_directory(campaign, none)) {
      files.push_back(campaign);
      continue;
    }
    const auto found = databases_in(campaign);
    if (!found) return found.error();
    if (std::filesystem::exists(campaign / "campaign.json", none))
      return Error{ErrorKind::invalid,
                   fmt::format("{}: is a recorded campaign's folder; only campaign databases (.db) "
                               "are pushed",
                               campaign.string())};
    if (found->empty() && !common.json)
      fmt::print("{} holds no campaign yet.\n", campaign.string());
    files.insert(files.end(), found->begin(), found->end());
  }
  return files;
}

int refuse_server(const Common& common, const std::string& place, const Error& error) {
  if (error.kind == ErrorKind::invalid) return fail(common, kBadInput, error.what);
  const std::string name = place.empty() ? "" : fmt::format(" ({})", place);
  if (error.kind == ErrorKind::refused)
    return fail(common, kRefused, fmt::format("the PostgreSQL server{}: {}", name, error.what));
  return fail(common, kUnreachable,
              fmt::format("the PostgreSQL server{} is away: {}{} {}", name, error.what,
                          error.what.ends_with('?') ? "" : ".", kKept));
}

void print_pushed(const std::filesystem::path& file, const PushedCampaign& pushed) {
  const std::string name = file.filename().string();
  const char* goes_on = pushed.complete ? "" : " The campaign goes on: push it again.";
  if (pushed.runs + pushed.cycles + pushed.estimates + pushed.alarms + pushed.facts == 0)
    fmt::print("{}: all of it was there (campaign {}).{}\n", name, pushed.id, goes_on);
  else
    fmt::print("{}: added {} runs, {} cycles, {} estimates, {} alarms, {} facts (campaign {}).{}\n",
               name, pushed.runs, pushed.cycles, pushed.estimates, pushed.alarms, pushed.facts,
               pushed.id, goes_on);
  std::fflush(stdout);
}

Json entry_of(const std::filesystem::path& file, const PushedCampaign& pushed) {
  return {{"file", file.string()},   {"id", pushed.id},         {"complete", pushed.complete},
          {"runs", pushed.runs},     {"cycles", pushed.cycles}, {"estimates", pushed.estimates},
          {"alarms", pushed.alarms}, {"facts", pushed.facts}};
}

// A file that cannot be read does not keep the others back.
int push_all(const Common& common, PostgresLink& server,
             const std::vector<std::filesystem::path>& files) {
  Json list = Json::array();
  bool good = true;
  for (const auto& file : files) {
    CampaignPush push(server, file);
    const auto pushed = push.push();
    if (!pushed && !push.at_file()) return refuse_server(common, server.place(), pushed.error());
    good = good && pushed;
    if (!pushed) {
      fmt::print(stderr, "shakerctl: {}\n", pushed.error().what);
      list.push_back({{"file", file.string()}, {"error", pushed.error().what}});
      continue;
    }
    if (!common.json) print_pushed(file, *pushed);
    list.push_back(entry_of(file, *pushed));
  }
  if (common.json) {
    const Json body = {{"server", server.place()}, {"campaigns", list}};
    fmt::print("{}\n", body.dump(-1, ' ', false, Json::error_handler_t::replace));
  }
  return good ? kOk : kBadInput;
}

}  // namespace

int push(const Common& common, const PushOptions& options) {
  if (!is_schema_name(options.schema))
    return fail(common, kBadInput,
                fmt::format("--schema {}: a name has lower-case letters, digits and _, and begins "
                            "with no digit",
                            options.schema));
  if (options.print_schema) {
    fmt::print("{}", layout_sql(options.schema));
    return kOk;
  }
  const auto files = files_to_push(common, options);
  if (!files) return fail(common, kBadInput, files.error().what);
  auto server = PostgresLink::connect(options.to, options.patience_s);
  if (!server) return refuse_server(common, "", server.error());
  if (auto prepared = prepare_tables(*server, options.schema); !prepared)
    return refuse_server(common, server->place(), prepared.error());
  return push_all(common, *server, *files);
}

}  // namespace shaker::cli
