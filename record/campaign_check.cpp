#include "record/campaign_check.hpp"

#include <fstream>

#include <fmt/format.h>
#include <sqlite3.h>
#include <system_error>

#include "record/checksums.hpp"
#include "record/file_parts.hpp"

namespace shaker::record {
namespace {

namespace fs = std::filesystem;

std::int64_t number(SQLite::Database& database, const char* sql) {
  return database.execAndGet(sql).getInt64();
}

// If SQLite does not understand a statement, the tables are not those of a campaign.
Error described_content(const SQLite::Exception& trouble, const fs::path& file) {
  Error error = describe(trouble, file);
  if (trouble.getErrorCode() == SQLITE_ERROR || trouble.getErrorCode() == SQLITE_MISMATCH)
    error = {ErrorKind::invalid, fmt::format("{}: its tables are not those of a campaign ({}).",
                                             file.string(), trouble.what())};
  return error;
}

Result<void> check_pages(SQLite::Database& database, const fs::path& file) {
  const std::string verdict = database.execAndGet("PRAGMA integrity_check(1)").getString();
  if (verdict == "ok") return {};
  return Error{ErrorKind::invalid, fmt::format("{}: is damaged ({}).", file.string(), verdict)};
}

Result<CheckedCampaign> checked(const fs::path& file, bool repair) {
  CheckedCampaign found;
  found.database = std::make_unique<SQLite::Database>(file.string(), SQLite::OPEN_READWRITE, 2000);
  SQLite::Database& database = *found.database;
  leave_log_at_close(database, true);
  found.empty = number(database, "SELECT count(*) FROM sqlite_schema") == 0;
  if (found.empty) return found;
  if (auto known = check_campaign(database, file, false); !known) return known.error();
  if (repair) database.exec("REINDEX");
  {
    SQLite::Statement row(database, "SELECT status, finished_utc FROM campaign");
    if (!row.executeStep())
      return Error{ErrorKind::invalid, fmt::format("{}: holds no campaign.", file.string())};
    found.status = row.getColumn(0).getString();
    found.finished = found.status != "running" && row.getColumn(1).getBytes() > 0;
  }
  if (found.finished && !holds_bytes(file.string() + "-wal")) return found;
  if (auto good = check_pages(database, file); !good) return good.error();
  add_row_sum(database);
  found.unsound = unsound_rows(database);
  return found;
}

// SQLite removes a log whose file is empty. A page of zeros prevents this, because the log
// contains that page.
Result<void> copy_file_or_zeros(const fs::path& file, const fs::path& copy) {
  if (holds_bytes(file)) return copy_part(file, copy);
  if (std::ofstream(copy, std::ios::binary) << std::string(4096, '\0')) return {};
  return Error{ErrorKind::io, fmt::format("{}: cannot be written.", copy.string())};
}

}  // namespace

bool holds_bytes(const fs::path& file) {
  std::error_code trouble;
  return fs::is_regular_file(fs::symlink_status(file, trouble)) &&
         fs::file_size(file, trouble) > 0 && !trouble;
}

bool is_there(const fs::path& file) {
  std::error_code trouble;
  return fs::symlink_status(file, trouble).type() != fs::file_type::not_found;
}

Result<CheckedCampaign> check_whole(const fs::path& file) {
  try {
    return checked(file, false);
  } catch (const SQLite::Exception& trouble) {
    return described_content(trouble, file);
  }
}

Recovered counted(SQLite::Database& database) {
  Recovered found;
  found.campaign = database.execAndGet("SELECT name FROM campaign").getString();
  found.runs = number(database, "SELECT count(*) FROM run");
  found.samples = number(database, "SELECT coalesce(sum(count), 0) FROM sample");
  found.cycles = number(database, "SELECT count(*) FROM cycle");
  found.documents = number(database, "SELECT count(*) FROM document");
  found.last_document = number(database, "SELECT coalesce(max(seq), 0) FROM document");
  found.missing_documents =
      number(database, "SELECT coalesce(max(seq) - min(seq) + 1, 0) - count(*) FROM document");
  return found;
}

void mark_and_fold(SQLite::Database& database, const std::string& now_utc) {
  {
    SQLite::Statement mark(database,
                           "UPDATE campaign SET status = 'interrupted', finished_utc = ?");
    mark.bind(1, now_utc);
    mark.exec();
  }
  leave_log_at_close(database, false);
  database.tryExec("PRAGMA wal_checkpoint(TRUNCATE)");
  database.tryExec("PRAGMA journal_mode=DELETE");
}

void leave_log_at_close(SQLite::Database& database, bool leave) {
  sqlite3_db_config(database.getHandle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, leave ? 1 : 0, nullptr);
}

Result<Recovered> read_copy(const fs::path& file, const fs::path& copy, bool with_log,
                            const std::string& now_utc) {
  if (auto made = copy_file_or_zeros(file, copy); !made) return made.error();
  if (with_log && holds_bytes(file.string() + "-wal")) {
    if (auto made = copy_part(file.string() + "-wal", copy.string() + "-wal"); !made)
      return made.error();
  }
  try {
    auto good = checked(copy, true);
    if (!good) return good.error();
    if (good->empty) return Error{ErrorKind::invalid, "It holds no table."};
    const std::int64_t unsound = good->unsound;
    if (unsound > 0) drop_unsound_rows(*good->database);
    Recovered found = counted(*good->database);
    found.unsound_rows = unsound;
    mark_and_fold(*good->database, now_utc);
    return found;
  } catch (const SQLite::Exception& trouble) {
    return described_content(trouble, file);
  }
}

}  // namespace shaker::record
