// Every page and every row of a campaign checked, and what it holds counted. Private to record/.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "record/database.hpp"
#include "record/recovery.hpp"

namespace shaker::record {

bool holds_bytes(const std::filesystem::path& file);  // a regular file of more than none
bool is_there(const std::filesystem::path& file);     // whatever it is

struct CheckedCampaign {
  std::unique_ptr<SQLite::Database> database;
  std::string status;
  bool finished = false;
  bool empty = false;        // a database without a table
  std::int64_t unsound = 0;  // rows that do not fit their checksum
};

// Changes not a byte of the file and its log, and leaves the log when the database is closed. A
// finished campaign without a log is not read through. `invalid`: the file's fault; `refused`: of a
// newer layout.
Result<CheckedCampaign> check_whole(const std::filesystem::path& file);

// Throws SQLite::Exception.
Recovered counted(SQLite::Database& database);

// Marks it `interrupted`, folds the log in and removes it: the campaign is one file. Throws
// SQLite::Exception.
void mark_and_fold(SQLite::Database& database, const std::string& now_utc);

// The log is folded in and removed when the last connection is closed, unless it is to be left.
void leave_log_at_close(SQLite::Database& database, bool leave);

// Copies `file` to `copy`, with or without its log; indexes are built anew and rows that do not
// fit their checksum left out there. What the copy holds then, marked as interrupted.
Result<Recovered> read_copy(const std::filesystem::path& file, const std::filesystem::path& copy,
                            bool with_log, const std::string& now_utc);

}  // namespace shaker::record
