#include "cli/push/campaign_push.hpp"

#include <algorithm>
#include <cstdlib>

#include <fmt/format.h>

#include "cli/documents_in.hpp"
#include "cli/push/layout.hpp"

namespace shaker::cli {
namespace {

constexpr std::int64_t kBatchRows = 500;         // estimates in a transaction
constexpr std::int64_t kLayoutLock = 5'459'011;  // for pg_advisory_lock, while tables are made

bool is_utc(const std::string& text) {
  return text.size() >= 20 && text[4] == '-' && text[10] == 'T' && text.back() == 'Z';
}

SqlValue time_or_null(const std::string& utc) {
  return is_utc(utc) ? SqlValue(utc) : std::nullopt;
}

// JSON as it is in the file; NULL where it is none.
SqlValue json_or_null(const std::string& text) {
  const std::string storable = storable_text(text);
  return nlohmann::json::accept(storable) ? SqlValue(storable) : std::nullopt;
}

std::string line_of(const nlohmann::json& document) {
  return document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string host_of(const std::vector<record::Fact>& facts) {
  const auto host = std::ranges::find(facts, std::string("host"), &record::Fact::kind);
  return host == facts.end() ? "" : host->value;
}

CopyRows& put_time(CopyRows& rows, const nlohmann::json& document) {
  const std::string utc = text_of(document, "t_utc");
  return is_utc(utc) ? rows.text(utc) : rows.null();
}

void put_estimate(CopyRows& rows, const std::string& id, const nlohmann::json& document) {
  rows.text(id).count(count_of(document, "seq"));
  put_time(rows, document);
  document.contains("run") ? rows.text(text_of(document, "run")) : rows.null();
  document.contains("cycle") ? rows.count(count_of(document, "cycle")) : rows.null();
  rows.count(count_of(document, "cycles_used")).flag(flag_of(document, "usable"));
  // Estimates of older programs do not say it: it was not examined.
  rows.flag(!document.contains("intervals_hold") || flag_of(document, "intervals_hold"));
  rows.number(number_of(document, "gap")).number(number_of(document, "noise_floor"));
  rows.text(line_of(document)).end_row();
}

void put_parameters(CopyRows& rows, const std::string& id, const nlohmann::json& document) {
  const auto found = document.find("parameters");
  if (found == document.end() || !found->is_array()) return;
  std::set<std::string> names;  // a damaged document may repeat one
  for (const nlohmann::json& one : *found) {
    const std::string name = storable_text(text_of(one, "name"));
    if (!names.insert(name).second) continue;
    const auto interval = one.is_object() ? one.value("interval", nlohmann::json()) : one;
    const auto bound = [&](std::size_t which) -> std::optional<double> {
      const bool there = interval.is_array() && interval.size() == 2 && interval[which].is_number();
      return there ? std::optional(interval[which].get<double>()) : std::nullopt;
    };
    rows.text(id).count(count_of(document, "seq")).text(name).text(text_of(one, "unit"));
    rows.number(number_of(one, "value")).number(number_of(one, "standard_error"));
    rows.number(bound(0)).number(bound(1)).flag(flag_of(one, "fixed")).end_row();
  }
}

}  // namespace

Result<void> prepare_tables(PostgresLink& server, const std::string& schema) {
  const std::string path = fmt::format("SET search_path = \"{}\"", schema);
  const auto there = [&] {
    return server.ask("SELECT to_regclass($1)", {fmt::format("\"{}\".layout", schema)});
  };
  auto found = there();
  if (!found) return found.error();
  if (!found->at(0).at(0)) {
    // Of two that come at once, the second finds the tables of the first.
    if (auto begun =
            server.ask(fmt::format("BEGIN; SELECT pg_advisory_xact_lock({})", kLayoutLock));
        !begun)
      return begun.error();
    found = there();
    if (!found) return found.error();
    if (!found->at(0).at(0)) {
      if (auto made = server.ask(layout_sql(schema)); !made)
        return Error{made.error().kind,
                     fmt::format("the tables cannot be made: {}; let somebody who may make them "
                                 "run what `shakerctl push --print-schema` prints",
                                 made.error().what)};
    }
    if (auto done = server.ask("COMMIT"); !done) return done.error();
  }
  if (auto chosen = server.ask(path); !chosen) return chosen.error();
  const auto version = server.ask("SELECT max(version) FROM layout");
  if (!version) return version.error();
  const int layout = std::atoi(version->at(0).at(0).value_or("0").c_str());
  if (layout != kPushLayout)
    return Error{
        ErrorKind::refused,
        fmt::format("its tables have layout {}, and this program knows {}; use the version "
                    "of shakerctl that made them, or another --schema",
                    layout, kPushLayout)};
  return {};
}

Result<PushedCampaign> CampaignPush::push() {
  at_file_ = true;
  const auto reader = record::CampaignReader::open(file_);
  if (!reader) return reader.error();
  const auto content = read(*reader);
  if (!content) return content.error();
  at_file_ = false;
  if (auto found = find_or_add(*content); !found) return found.error();
  if (auto added = add_runs(*content); !added) return added.error();
  if (auto added = add_cycles(*reader, *content); !added) return added.error();
  if (auto added = add_estimates(*content); !added) return added.error();
  if (auto added = add_alarms(*content); !added) return added.error();
  if (auto added = add_facts(*content); !added) return added.error();
  if (auto closed = close(*content); !closed) return closed.error();
  return pushed_;
}

// The campaign's end is read before its rows: whoever reads an end then reads all of them.
Result<CampaignPush::Content> CampaignPush::read(const record::CampaignReader& reader) const {
  Content content;
  auto campaign = reader.campaign();
  if (!campaign) return campaign.error();
  content.campaign = std::move(*campaign);
  if (!is_utc(content.campaign.started_utc))
    return Error{ErrorKind::invalid,
                 fmt::format("{}: the campaign's start is no time: '{}'", file_.string(),
                             printable(content.campaign.started_utc))};
  auto runs = reader.runs();
  if (!runs) return runs.error();
  content.runs = std::move(*runs);
  auto facts = reader.facts();
  if (!facts) return facts.error();
  content.facts = std::move(*facts);
  const auto lines = reader.documents();
  if (!lines) return lines.error();
  for (const std::string& line : *lines) {
    auto document = nlohmann::json::parse(line, nullptr, false);
    const std::string type = text_of(document, "type");
    if (type == "estimate") content.estimates.push_back(std::move(document));
    if (type == "alarm") content.alarms.push_back(std::move(document));
  }
  return content;
}

Result<void> CampaignPush::find_or_add(const Content& content) {
  const auto& c = content.campaign;
  const std::vector<SqlValue> key = {storable_text(host_of(content.facts)), storable_text(c.rig),
                                     storable_text(c.name), c.started_utc};
  const auto find = [&]() -> Result<void> {
    const auto found = server_.ask(
        "SELECT id FROM campaign WHERE host = $1 AND rig = $2 AND name = $3 AND started_utc = $4",
        key);
    if (!found) return found.error();
    if (!found->empty()) pushed_.id = found->at(0).at(0).value_or("");
    return {};
  };
  if (auto found = find(); !found) return found.error();
  if (!pushed_.id.empty()) return lock();
  std::vector<SqlValue> row = key;
  const auto model = nlohmann::json::parse(c.model_json, nullptr, false);
  row.insert(row.end(), {"running", storable_text(file_.filename().string()),
                         storable_text(text_of(model, "name")), json_or_null(c.spec_json),
                         json_or_null(c.model_json)});
  // Of two that come at once, one adds the row, and both find it.
  if (auto added = server_.ask("INSERT INTO campaign(host, rig, name, started_utc, status, file, "
                               "model, campaign_file, model_file) VALUES ($1, $2, $3, $4, $5, $6, "
                               "$7, $8, $9) ON CONFLICT DO NOTHING",
                               row);
      !added)
    return added.error();
  if (auto found = find(); !found) return found.error();
  return lock();
}

// Until the connection ends or the next campaign of this connection.
Result<void> CampaignPush::lock() {
  const auto locked =
      server_.ask("SELECT pg_advisory_unlock_all(), pg_try_advisory_lock(hashtextextended($1, 0))",
                  {fmt::format("shakerctl push {}", pushed_.id)});
  if (!locked) return locked.error();
  if (locked->at(0).at(1) != "t")
    return Error{ErrorKind::refused, fmt::format("another push sends {} at this moment; let it end",
                                                 file_.filename().string())};
  return {};
}

Result<CampaignPush::Keys> CampaignPush::keys(const std::string& columns,
                                              const std::string& table) {
  const auto rows = server_.ask(
      fmt::format("SELECT {} FROM {} WHERE campaign = $1", columns, table), {pushed_.id});
  if (!rows) return rows.error();
  Keys keys;
  for (const auto& row : *rows)
    keys.emplace(std::atoll(row[0].value_or("").c_str()), std::atoll(row[1].value_or("").c_str()));
  return keys;
}

Result<void> CampaignPush::add(const std::string& into, const CopyRows& rows, std::int64_t& added) {
  if (rows.rows() == 0) return {};
  if (auto copied = server_.copy(into, rows.bytes()); !copied) return copied.error();
  added += rows.rows();
  return {};
}

Result<void> CampaignPush::add_runs(const Content& content) {
  const auto there = keys("run, 0", "run");
  if (!there) return there.error();
  CopyRows rows;
  for (const record::RunRow& run : content.runs) {
    if (there->contains({run.index, 0})) continue;
    rows.text(pushed_.id).count(run.index).text(run.name).number(run.frequency_hz);
    rows.number(run.amplitude).count(run.cycles_wanted).end_row();
  }
  return add("run(campaign, run, name, frequency_hz, amplitude, cycles_wanted)", rows,
             pushed_.runs);
}

Result<void> CampaignPush::add_cycles(const record::CampaignReader& reader,
                                      const Content& content) {
  const auto there = keys("run, cycle", "cycle");
  if (!there) return there.error();
  for (const record::RunRow& run : content.runs) {
    const auto cycles = reader.cycles(run.index);
    at_file_ = !cycles;
    if (!cycles) return cycles.error();
    CopyRows rows;
    for (const record::CycleRow& cycle : *cycles) {
      if (there->contains({cycle.run, cycle.index})) continue;
      rows.text(pushed_.id).count(cycle.run).count(cycle.index).flag(cycle.accepted);
      rows.number(cycle.frequency_hz).number(cycle.amplitude).number(cycle.excitation_error);
      rows.array(cycle.displacement).array(cycle.excitation).end_row();
    }
    if (auto added = add("cycle(campaign, run, cycle, accepted, frequency_hz, amplitude, "
                         "excitation_error, displacement, excitation)",
                         rows, pushed_.cycles);
        !added)
      return added.error();
  }
  return {};
}

Result<void> CampaignPush::add_estimates(const Content& content) {
  const auto there = keys("seq, 0", "estimate");
  if (!there) return there.error();
  CopyRows estimates, parameters;
  for (const nlohmann::json& document : content.estimates) {
    if (there->contains({count_of(document, "seq"), 0})) continue;
    put_estimate(estimates, pushed_.id, document);
    put_parameters(parameters, pushed_.id, document);
    if (estimates.rows() < kBatchRows) continue;
    if (auto added = add_batch(estimates, parameters); !added) return added.error();
    estimates = parameters = {};
  }
  return add_batch(estimates, parameters);
}

Result<void> CampaignPush::add_batch(const CopyRows& estimates, const CopyRows& parameters) {
  if (estimates.rows() == 0) return {};
  if (auto begun = server_.ask("BEGIN"); !begun) return begun.error();
  if (auto added = add("estimate(campaign, seq, utc, run, cycle, cycles_used, usable, "
                       "intervals_hold, gap, noise_floor, document)",
                       estimates, pushed_.estimates);
      !added)
    return added.error();
  std::int64_t with_them = 0;
  if (auto added = add("parameter(campaign, seq, name, unit, value, standard_error, lower, upper, "
                       "fixed)",
                       parameters, with_them);
      !added)
    return added.error();
  const auto done = server_.ask("COMMIT");
  return done ? Result<void>() : done.error();
}

Result<void> CampaignPush::add_alarms(const Content& content) {
  const auto there = keys("seq, 0", "alarm");
  if (!there) return there.error();
  CopyRows rows;
  for (const nlohmann::json& document : content.alarms) {
    if (there->contains({count_of(document, "seq"), 0})) continue;
    rows.text(pushed_.id).count(count_of(document, "seq"));
    put_time(rows, document).text(text_of(document, "severity")).text(text_of(document, "code"));
    rows.text(text_of(document, "text")).text(line_of(document)).end_row();
  }
  return add("alarm(campaign, seq, utc, severity, code, text, document)", rows, pushed_.alarms);
}

Result<void> CampaignPush::add_facts(const Content& content) {
  const auto there = keys("fact, 0", "fact");
  if (!there) return there.error();
  CopyRows rows;
  for (std::size_t i = 0; i < content.facts.size(); ++i) {
    const auto number = static_cast<std::int64_t>(i);
    if (there->contains({number, 0})) continue;
    const record::Fact& fact = content.facts[i];
    rows.text(pushed_.id).count(number).text(fact.kind).text(fact.name).text(fact.value);
    rows.text(fact.utc).text(fact.sha256).end_row();
  }
  return add("fact(campaign, fact, kind, name, value, utc, sha256)", rows, pushed_.facts);
}

Result<void> CampaignPush::close(const Content& content) {
  const auto& c = content.campaign;
  pushed_.complete = c.status != "running";
  const auto done = server_.ask(
      "UPDATE campaign SET status = $2, finished_utc = $3, complete = $4 WHERE id = $1 AND "
      "(status, finished_utc, complete) IS DISTINCT FROM ($2, $3::timestamptz, $4::boolean)",
      {pushed_.id, storable_text(c.status), time_or_null(c.finished_utc),
       pushed_.complete ? "t" : "f"});
  return done ? Result<void>() : done.error();
}

}  // namespace shaker::cli
