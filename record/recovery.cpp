#include "record/recovery.hpp"

#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <system_error>

#include "record/database.hpp"

namespace shaker::record {
namespace {

namespace fs = std::filesystem;

std::int64_t count(SQLite::Database& database, const char* sql) {
  return database.execAndGet(sql).getInt64();
}

Recovered set_aside(const fs::path& file, const std::string& now_utc, const Error& why) {
  std::string stamp = now_utc;
  std::erase_if(stamp, [](char c) { return c == ':' || c == '.'; });
  const std::string suffix = ".damaged-" + stamp;
  Recovered found;
  found.damaged = true;
  found.file = file.string() + suffix;
  std::error_code trouble, ignored;
  fs::rename(file, found.file, trouble);
  for (const char* part : {"-wal", "-shm"}) {
    fs::rename(file.string() + part, found.file.string() + part, ignored);
  }
  found.what =
      trouble ? fmt::format("{} It could not be set aside ({}).", why.what, trouble.message())
              : fmt::format("{} It was set aside as {}.", why.what, found.file.filename().string());
  if (trouble) found.file = file;
  return found;
}

// Counts and marks. Throws SQLite::Exception.
Recovered close_interrupted(SQLite::Database& database, const fs::path& file,
                            const std::string& now_utc) {
  Recovered found;
  found.file = file;
  found.campaign = database.execAndGet("SELECT name FROM campaign").getString();
  found.runs = count(database, "SELECT count(*) FROM run");
  found.samples = count(database, "SELECT coalesce(sum(count), 0) FROM sample");
  found.cycles = count(database, "SELECT count(*) FROM cycle");
  found.documents = count(database, "SELECT count(*) FROM document");
  SQLite::Statement mark(database, "UPDATE campaign SET status = 'interrupted', finished_utc = ?");
  mark.bind(1, now_utc);
  mark.exec();
  database.tryExec("PRAGMA wal_checkpoint(TRUNCATE)");
  database.tryExec("PRAGMA journal_mode=DELETE");
  found.what = fmt::format(
      "Campaign {} was interrupted; {} holds {} runs, {} samples, {} cycles and {} documents, all "
      "whole. Start it again to measure the rest.",
      found.campaign, file.string(), found.runs, found.samples, found.cycles, found.documents);
  return found;
}

// A writer that died before its first commit leaves a file without tables: there is nothing in it.
bool never_began(const fs::path& file) {
  std::error_code ignored;
  if (fs::file_size(file, ignored) == 0) return true;
  try {
    SQLite::Database database(file.string(), SQLite::OPEN_READWRITE, 2000);
    return count(database, "SELECT count(*) FROM sqlite_schema") == 0;
  } catch (const SQLite::Exception&) {
    return false;
  }
}

void remove_with_log(const fs::path& file) {
  std::error_code ignored;
  for (const char* part : {"", "-wal", "-shm"})
    fs::remove(file.string() + part, ignored);
}

// Nothing when the file is finished, or of a newer version.
std::optional<Recovered> recover_file(const fs::path& file, const std::string& now_utc) {
  const auto given_up = [&](const Error& why) {
    if (why.kind == ErrorKind::invalid) return set_aside(file, now_utc, why);
    Recovered found;  // the disk's trouble, not the file's: leave it where it is
    found.file = file;
    found.what = why.what;
    return found;
  };
  try {
    // Light first: a finished campaign of a gigabyte must not delay the start.
    auto database = open_campaign(file, true, false);
    if (!database) {
      if (database.error().kind == ErrorKind::refused) return std::nullopt;
      return given_up(database.error());
    }
    const std::string status = (*database)->execAndGet("SELECT status FROM campaign").getString();
    if (status != "running") return std::nullopt;
    database = open_campaign(file, true, true);
    if (!database) return given_up(database.error());
    return close_interrupted(**database, file, now_utc);
  } catch (const SQLite::Exception& error) {
    return given_up(describe(error, file));
  }
}

}  // namespace

std::vector<Recovered> recover(const fs::path& directory, const std::string& now_utc) {
  std::vector<fs::path> files;
  std::error_code trouble;
  for (const auto& entry : fs::directory_iterator(directory, trouble)) {
    if (entry.path().extension() == ".db") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::vector<Recovered> all;
  for (const auto& file : files) {
    if (never_began(file)) {
      remove_with_log(file);
    } else if (auto found = recover_file(file, now_utc)) {
      all.push_back(std::move(*found));
    }
  }
  return all;
}

}  // namespace shaker::record
