#include "cli/push/postgres_link.hpp"

#include <algorithm>
#include <cmath>
#include <libpq-fe.h>
#include <string_view>

#include <fmt/format.h>
#include <poll.h>

namespace shaker::cli {
namespace {

constexpr std::size_t kCopyChunk = 256 * 1024;  // bytes

struct ConninfoFree {
  void operator()(PQconninfoOption* options) const { ::PQconninfoFree(options); }
};
using Conninfo = std::unique_ptr<PQconninfoOption, ConninfoFree>;

// The messages of libpq end in a line break and may have several lines.
std::string one_line(std::string_view said) {
  std::string line;
  for (const char c : said) {
    const bool blank = c == '\n' || c == '\r' || c == '\t' || c == ' ';
    if (!blank)
      line += c;
    else if (!line.empty() && line.back() != ' ')
      line += ' ';
  }
  while (!line.empty() && line.back() == ' ')
    line.pop_back();
  return line;
}

Result<void> check_where(const std::string& where) {
  char* said = nullptr;
  const Conninfo options(::PQconninfoParse(where.c_str(), &said));
  if (!options) {
    Error error{ErrorKind::invalid,
                fmt::format("--to: {}; give for example \"host=db.example dbname=lab user=rig\"",
                            said == nullptr ? "out of memory" : one_line(said))};
    ::PQfreemem(said);
    return error;
  }
  for (const PQconninfoOption* one = options.get(); one->keyword != nullptr; ++one) {
    if (std::string_view(one->keyword) == "password" && one->val != nullptr)
      return Error{ErrorKind::invalid,
                   "--to must not hold a password, which every user of this PC could read; put it "
                   "into ~/.pgpass, or name a file by passfile="};
  }
  return {};
}

}  // namespace

void PostgresLink::Closer::operator()(pg_conn* connection) const {
  ::PQfinish(connection);
}
void PostgresLink::Cleared::operator()(pg_result* result) const {
  ::PQclear(result);
}

PostgresLink::PostgresLink(pg_conn* connection, double patience_s)
    : connection_(connection), patience_s_(patience_s) {
  const auto known = [](const char* text) { return text == nullptr ? "" : text; };
  place_ = fmt::format("{}:{}, database {}", known(::PQhost(connection)),
                       known(::PQport(connection)), known(::PQdb(connection)));
}

Result<PostgresLink> PostgresLink::connect(const std::string& where, double patience_s) {
  if (auto good = check_where(where); !good) return good.error();
  const std::string seconds = fmt::format("{}", std::max(2.0, std::ceil(patience_s)));
  // Of a keyword that comes twice the last one counts: the caller's own connect_timeout does.
  const char* keywords[] = {"connect_timeout", "fallback_application_name", "dbname", nullptr};
  const char* values[] = {seconds.c_str(), "shakerctl push", where.c_str(), nullptr};
  PostgresLink link(::PQconnectdbParams(keywords, values, 1), patience_s);
  if (::PQstatus(link.connection_.get()) != CONNECTION_OK)
    return Error{ErrorKind::unavailable, one_line(::PQerrorMessage(link.connection_.get()))};
  ::PQsetnonblocking(link.connection_.get(), 1);
  // Notices would go to stderr between the sentences.
  ::PQsetNoticeProcessor(
      link.connection_.get(), [](void*, const char*) {}, nullptr);
  if (auto set = link.ask("SET client_encoding = 'UTF8'"); !set) return set.error();
  return link;
}

Error PostgresLink::trouble(const std::string& said) const {
  const bool lost = ::PQstatus(connection_.get()) != CONNECTION_OK;
  const std::string why = said.empty() ? one_line(::PQerrorMessage(connection_.get())) : said;
  return {lost ? ErrorKind::unavailable : ErrorKind::refused, why};
}

Result<void> PostgresLink::wait(short events) {
  pollfd ready{::PQsocket(connection_.get()), events, 0};
  const int found = ::poll(&ready, 1, static_cast<int>(patience_s_ * 1e3));
  if (found == 0)
    return Error{ErrorKind::timeout, fmt::format("it has said nothing for {} s", patience_s_)};
  if ((ready.revents & POLLIN) != 0 && ::PQconsumeInput(connection_.get()) == 0) return trouble("");
  return {};
}

Result<void> PostgresLink::flush() {
  for (int left = ::PQflush(connection_.get()); left != 0; left = ::PQflush(connection_.get())) {
    if (left < 0) return trouble("");
    if (auto waited = wait(POLLIN | POLLOUT); !waited) return waited.error();
  }
  return {};
}

Result<PostgresLink::PgResult> PostgresLink::next_result() {
  if (auto flushed = flush(); !flushed) return flushed.error();
  while (::PQisBusy(connection_.get()) != 0) {
    if (auto waited = wait(POLLIN); !waited) return waited.error();
  }
  return PgResult(::PQgetResult(connection_.get()));
}

Result<SqlRows> PostgresLink::all_results() {
  SqlRows rows;
  std::optional<Error> error;
  while (true) {
    auto result = next_result();
    if (!result) return result.error();
    const pg_result* got = result->get();
    if (got == nullptr) break;
    const auto status = ::PQresultStatus(got);
    if (status == PGRES_FATAL_ERROR || status == PGRES_BAD_RESPONSE) {
      if (!error) error = trouble(one_line(::PQresultErrorMessage(got)));
      continue;
    }
    for (int row = 0; row < ::PQntuples(got); ++row) {
      rows.emplace_back();
      for (int column = 0; column < ::PQnfields(got); ++column) {
        if (::PQgetisnull(got, row, column) != 0)
          rows.back().emplace_back();
        else
          rows.back().emplace_back(::PQgetvalue(got, row, column));
      }
    }
  }
  if (error) return *error;
  return rows;
}

Result<SqlRows> PostgresLink::ask(const std::string& sql, const std::vector<SqlValue>& parameters) {
  std::vector<const char*> values;
  for (const SqlValue& parameter : parameters)
    values.push_back(parameter ? parameter->c_str() : nullptr);
  const int sent =
      parameters.empty()
          ? ::PQsendQuery(connection_.get(), sql.c_str())
          : ::PQsendQueryParams(connection_.get(), sql.c_str(), static_cast<int>(values.size()),
                                nullptr, values.data(), nullptr, nullptr, 0);
  if (sent == 0) return trouble("");
  return all_results();
}

Result<void> PostgresLink::copy(const std::string& into, const std::string& rows) {
  if (::PQsendQuery(connection_.get(), ("COPY " + into + " FROM STDIN").c_str()) == 0)
    return trouble("");
  {
    auto begun = next_result();
    if (!begun) return begun.error();
    if (::PQresultStatus(begun->get()) != PGRES_COPY_IN)
      return trouble(one_line(::PQresultErrorMessage(begun->get())));
  }
  for (std::size_t at = 0; at < rows.size(); at += kCopyChunk) {
    const std::size_t size = std::min(kCopyChunk, rows.size() - at);
    if (::PQputCopyData(connection_.get(), rows.data() + at, static_cast<int>(size)) <= 0)
      return trouble("");
    if (auto flushed = flush(); !flushed) return flushed.error();
  }
  if (::PQputCopyEnd(connection_.get(), nullptr) <= 0) return trouble("");
  const auto done = all_results();
  return done ? Result<void>() : done.error();
}

}  // namespace shaker::cli
