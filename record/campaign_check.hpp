// Checks every page and every row of a campaign, and counts its contents. Private to record/.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "record/database.hpp"
#include "record/recovery.hpp"

namespace shaker::record {

bool holds_bytes(const std::filesystem::path& file);  // a regular file that is not empty
bool is_there(const std::filesystem::path& file);     // a file of any type

struct CheckedCampaign {
  std::unique_ptr<SQLite::Database> database;
  std::string status;
  bool finished = false;
  bool empty = false;        // a database without a table
  std::int64_t unsound = 0;  // rows that do not match their checksum
};

// Checks a campaign without changing its file or log; the log stays when the database is
// closed. A finished campaign without a log is not read completely. `invalid`: the file is at
// fault; `refused`: it has a newer layout.
Result<CheckedCampaign> check_whole(const std::filesystem::path& file);

// Counts the contents. Throws SQLite::Exception.
Recovered counted(SQLite::Database& database);

// Marks the campaign as `interrupted`, folds the log in and removes it, so that the campaign is
// one file. Throws SQLite::Exception.
void mark_and_fold(SQLite::Database& database, const std::string& now_utc);

// Whether the log is left as it is when the last connection is closed, or folded in and
// removed.
void leave_log_at_close(SQLite::Database& database, bool leave);

// Copies `file` to `copy`, with or without its log. In the copy, rebuilds the indexes, removes
// rows that do not match their checksum, and marks the campaign as interrupted. Returns the
// contents of the copy.
Result<Recovered> read_copy(const std::filesystem::path& file, const std::filesystem::path& copy,
                            bool with_log, const std::string& now_utc);

}  // namespace shaker::record
