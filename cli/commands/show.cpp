// show: what one campaign database holds, with its alarms and its last estimate.
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/campaign_place.hpp"
#include "cli/campaign_summary.hpp"
#include "cli/commands.hpp"
#include "cli/documents_in.hpp"
#include "cli/utc_text.hpp"
#include "record/provenance.hpp"
#include "report/estimate_table.hpp"
#include "report/text_table.hpp"

namespace shaker::cli {
namespace {

std::string runs_table(const std::vector<RunSummary>& runs) {
  std::vector<std::vector<std::string>> rows = {
      {"run", "frequency, Hz", "amplitude, m/s^2", "accepted", "left out", "wanted"}};
  for (const RunSummary& run : runs)
    rows.push_back({printable(run.row.name), fmt::format("{:.6g}", run.row.frequency_hz),
                    fmt::format("{:.6g}", run.row.amplitude), std::to_string(run.accepted),
                    std::to_string(run.left_out), std::to_string(run.row.cycles_wanted)});
  return report::text_table(rows, {false, true, true, true, true, true});
}

// The value itself, or how long it is where it has several lines.
std::string in_short(const std::string& value) {
  constexpr std::size_t kLongest = 100;
  if (value.size() <= kLongest && value.find('\n') == std::string::npos) return printable(value);
  return fmt::format("{} bytes", value.size());
}

// Campaign and model are facts too: their texts have columns of their own in the database, and
// their hashes are facts named "sha256". Older files have no such hash.
std::vector<record::Fact> facts_of(const CampaignSummary& s) {
  std::vector<record::Fact> facts;
  std::map<std::string, std::string> hashes;
  for (const record::Fact& fact : s.facts) {
    if (fact.name == "sha256")
      hashes[fact.kind] = fact.value;
    else
      facts.push_back(fact);
  }
  for (const auto& [kind, text] :
       {std::pair{"campaign", &s.row.spec_json}, std::pair{"model", &s.row.model_json}})
    facts.push_back({kind, "as run", *text, s.row.started_utc,
                     hashes.contains(kind) ? hashes[kind] : record::sha256(*text)});
  return facts;
}

std::string facts_table(const std::vector<record::Fact>& facts) {
  std::vector<std::vector<std::string>> rows = {{"of", "what", "value", "sha256"}};
  for (const record::Fact& fact : facts) {
    if (fact.kind == "note") continue;
    rows.push_back({printable(fact.kind), printable(fact.name), in_short(fact.value),
                    record::holds(fact) ? fact.sha256.substr(0, 12) : "DOES NOT MATCH"});
  }
  return report::text_table(rows, {false, false, false, false});
}

void print_notes(const std::vector<record::Fact>& facts) {
  for (const record::Fact& fact : facts) {
    if (fact.kind != "note") continue;
    fmt::print("note of {} by {}: {}{}\n", readable_utc(fact.utc), printable(fact.name),
               printable(fact.value), record::holds(fact) ? "" : " (ITS HASH DOES NOT MATCH)");
  }
}

nlohmann::ordered_json facts_json(const std::vector<record::Fact>& facts) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const record::Fact& fact : facts)
    list.push_back({{"of", fact.kind},
                    {"what", fact.name},
                    {"value", fact.value},
                    {"utc", fact.utc},
                    {"sha256", fact.sha256},
                    {"hash_matches", record::holds(fact)}});
  return list;
}

void print_summary(const CampaignSummary& s) {
  fmt::print("campaign {} on rig {}, model {}\n", printable(s.row.name), printable(s.row.rig),
             printable(s.model));
  fmt::print("measured {}{}, {}\n\n", readable_utc(s.row.started_utc),
             s.row.finished_utc.empty() ? "" : " to " + readable_utc(s.row.finished_utc),
             printable(s.row.status));
  fmt::print("{}\n{}", runs_table(s.runs), facts_table(facts_of(s)));
  print_notes(s.facts);
  for (std::size_t i = 0; i < s.alarms.size(); ++i)
    fmt::print("{}{}  {}\n", i == 0 ? "\n" : "", readable_utc(text_of(s.alarms[i], "t_utc")),
               narrate(s.alarms[i]));
  if (!s.estimate.is_null()) fmt::print("\n{}", report::estimate_table(estimate_from(s.estimate)));
}

nlohmann::ordered_json summary_json(const CampaignSummary& s, const std::filesystem::path& file) {
  nlohmann::ordered_json runs = nlohmann::ordered_json::array();
  for (const RunSummary& run : s.runs)
    runs.push_back({{"name", run.row.name},
                    {"frequency_hz", run.row.frequency_hz},
                    {"amplitude", run.row.amplitude},
                    {"cycles_wanted", run.row.cycles_wanted},
                    {"cycles_accepted", run.accepted},
                    {"cycles_left_out", run.left_out}});
  return {{"file", file.string()},
          {"campaign", s.row.name},
          {"rig", s.row.rig},
          {"model", s.model},
          {"started_utc", s.row.started_utc},
          {"finished_utc", s.row.finished_utc},
          {"status", s.row.status},
          {"runs", std::move(runs)},
          {"facts", facts_json(facts_of(s))},
          {"alarms", s.alarms},
          {"estimate", s.estimate}};
}

}  // namespace

int show(const Common& common, const ShowOptions& options) {
  if (auto good = expect_file(options.file); !good)
    return fail(common, kBadInput, good.error().what);
  const auto summary = summarise(options.file, true);
  if (!summary) return fail(common, kBadInput, summary.error().what);
  if (common.json) {
    fmt::print("{}\n", summary_json(*summary, options.file)
                           .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  } else {
    print_summary(*summary);
  }
  return kOk;
}

}  // namespace shaker::cli
