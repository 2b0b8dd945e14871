// A connection to a PostgreSQL server that never waits longer than it was told to. One thread.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

struct pg_conn;
struct pg_result;

namespace shaker::cli {

using SqlValue = std::optional<std::string>;  // nothing: NULL
using SqlRows = std::vector<std::vector<SqlValue>>;

// An Error is `unavailable` or `timeout` where the server is away, and `refused` where it answered
// and would not. The connection is then of no use any more; the server rolls back what was not
// committed.
class PostgresLink {
 public:
  // `where`: a connection string or address of libpq; empty: its environment (PGHOST, ...). The
  // Error is `invalid` if the string is wrong or holds a password. `patience_s`: the longest
  // silence of the server, at least 2 s for the connection itself.
  static Result<PostgresLink> connect(const std::string& where, double patience_s);

  // "HOST:PORT, database NAME"
  const std::string& place() const { return place_; }
  // One statement with parameters $1, $2, ...; without parameters also several statements.
  Result<SqlRows> ask(const std::string& sql, const std::vector<SqlValue>& parameters = {});
  // COPY `into` FROM STDIN; `rows` as CopyRows makes them. One round trip.
  Result<void> copy(const std::string& into, const std::string& rows);

 private:
  struct Closer {
    void operator()(pg_conn* connection) const;
  };
  struct Cleared {
    void operator()(pg_result* result) const;
  };
  using PgResult = std::unique_ptr<pg_result, Cleared>;
  PostgresLink(pg_conn* connection, double patience_s);

  Error trouble(const std::string& said) const;
  Result<void> wait(short events);  // for the socket
  Result<void> flush();
  Result<PgResult> next_result();  // null: there is none any more
  Result<SqlRows> all_results();

  std::unique_ptr<pg_conn, Closer> connection_;
  double patience_s_;
  std::string place_;
};

}  // namespace shaker::cli
