#include "record/recovery.hpp"

#include <fstream>
#include <iterator>
#include <set>

#include <fmt/format.h>
#include <sqlite3.h>
#include <system_error>

#include "record/campaign_check.hpp"
#include "record/file_parts.hpp"
#include "record/findings.hpp"
#include "record/write_ahead_log.hpp"

namespace shaker::record {
namespace {

namespace fs = std::filesystem;

// SQLite rewrites the log's index when it opens the file, even if it then refuses it.
std::string content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void put_back(const std::string& bytes, const fs::path& file) {
  if (holds_bytes(file)) std::ofstream(file, std::ios::binary) << bytes;
}

Recovered left_alone(const fs::path& file, const std::string& why) {
  Recovered found;
  found.file = file;
  found.what = why;
  return found;
}

bool is_files_fault(const Error& error) {
  return error.kind == ErrorKind::invalid;
}

// Renames the campaign with all its parts. `read`: a copy with the readable contents, which
// takes the file's place.
Recovered set_aside(const fs::path& file, const std::string& now_utc, Recovered found,
                    const fs::path& read) {
  found.damaged = true;
  found.aside = aside_name(file, "damaged", now_utc);
  found.file = found.aside;
  if (auto moved = move_parts(file, found.aside); !moved) {
    if (!is_there(found.aside)) found.file = file;
    found.what = " It could not be set aside: " + moved.error().what;
    return found;
  }
  if (!read.empty()) {
    std::error_code trouble;
    fs::rename(read, file, trouble);
    found.file = trouble ? read : file;
  }
  return found;
}

struct Salvaged {
  std::optional<Recovered> found;  // contents of the copy
  fs::path copy;
  bool alone = false;            // read without its log
  std::optional<Error> trouble;  // an error that the file did not cause
};

// Reads the file with its log, and the file alone, because the log may already be folded in.
// Keeps the copy that holds more.
Salvaged read_copies(const fs::path& file, const std::string& now_utc) {
  Salvaged best;
  for (const bool alone : {false, true}) {
    if (alone && (!holds_bytes(file) || !holds_bytes(file.string() + "-wal"))) continue;
    const fs::path copy = file.string() + (alone ? ".reading-alone" : ".reading");
    remove_parts(copy);
    auto read = read_copy(file, copy, !alone, now_utc);
    if (read && (!best.found || read->documents > best.found->documents)) {
      if (best.found) remove_parts(best.copy);
      best = {std::move(*read), copy, alone, best.trouble};
    } else {
      remove_parts(copy);
    }
    if (!read && !is_files_fault(read.error())) best.trouble = read.error();
  }
  return best;
}

// Handles a log that cannot be read to its end, or a damaged file.
std::optional<Recovered> salvage(const fs::path& file, const LogReading& log,
                                 const std::string& now_utc, const Error& why) {
  Salvaged read = read_copies(file, now_utc);
  if (!read.found && read.trouble && read.trouble->kind == ErrorKind::refused)
    return left_alone(file, read.trouble->what);
  Recovered found = read.found.value_or(Recovered{});
  const bool folded = read.alone && log.indexed && *log.folded >= *log.indexed;
  found.lost_commits = folded ? 0 : log.lost_commits;
  found = set_aside(file, now_utc, std::move(found), read.copy);
  if (!read.copy.empty() && found.file == found.aside) remove_parts(read.copy);
  found.what = damage_sentence(file, found, log, why, read.found.has_value()) + found.what;
  if (read.trouble) found.what += " Not all could be tried: " + read.trouble->what;
  return found;
}

// Handles a file without a table: its writer ended before the first commit, or its log is gone.
Recovered never_began(const fs::path& file, const LogReading& log, const std::string& now_utc) {
  Recovered found;
  found.aside = aside_name(file, "unbegun", now_utc);
  found.file = found.aside;
  const auto moved = move_parts(file, found.aside);
  if (!moved) found.file = file;
  found.lost_commits = log.lost_commits;
  found.what = unbegun_sentence(file, found, log) + (moved ? "" : " " + moved.error().what);
  return found;
}

// True for a file without contents, log or journal.
bool is_void(const fs::path& file, const LogReading& log) {
  return !holds_bytes(file) && log.bytes == 0 && log.indexed.value_or(0) == 0 &&
         !holds_bytes(file.string() + "-journal");
}

// Escapes "?", "%" and "#", which have a meaning in the address of a file.
std::string address(const fs::path& file) {
  std::string text = "file:";
  for (const char c : fs::absolute(file).string())
    text += c == '?' || c == '%' || c == '#' ? fmt::format("%{:02X}", c) : std::string(1, c);
  return text + "?immutable=1";
}

// Examines the file alone, without a lock and without writing.
bool looks_finished(const fs::path& file) {
  try {
    SQLite::Database database(address(file), SQLite::OPEN_READONLY | SQLITE_OPEN_URI);
    const auto known = check_campaign(database, file, false);
    if (!known && known.error().kind != ErrorKind::refused) return false;
    return database.execAndGet("SELECT status <> 'running' AND finished_utc <> '' FROM campaign")
               .getInt() != 0;
  } catch (const SQLite::Exception&) {
    return false;
  }
}

Error unsound_error(const fs::path& file, std::int64_t unsound) {
  return {ErrorKind::invalid,
          fmt::format("{}: {} rows do not fit their checksums.", file.string(), unsound)};
}

// Nothing has been changed so far, except that SQLite rewrites the log's index when it opens
// the file.
std::optional<Recovered> close_checked(const fs::path& file, const LogReading& log,
                                       const fs::path& kept, const std::string& now_utc) {
  auto checked = check_whole(file);
  if (!checked && checked.error().kind == ErrorKind::refused)
    return looks_finished(file) ? std::nullopt
                                : std::optional(left_alone(file, checked.error().what));
  if (!checked && !is_files_fault(checked.error())) return left_alone(file, checked.error().what);
  if (!checked) return salvage(file, log, now_utc, checked.error());
  if (checked->empty || checked->unsound > 0) {
    checked->database.reset();
    return checked->empty ? never_began(file, log, now_utc)
                          : salvage(file, log, now_utc, unsound_error(file, checked->unsound));
  }
  leave_log_at_close(*checked->database, false);
  if (checked->finished && kept.empty()) return std::nullopt;
  Recovered found;
  try {
    found = counted(*checked->database);
    found.file = file;
    if (!checked->finished) mark_and_fold(*checked->database, now_utc);
  } catch (const SQLite::Exception& trouble) {
    found.file = file;
    found.what = describe(trouble, file).what;
    return found;
  }
  if (!kept.empty()) found.aside = kept.string() + "-wal";
  found.lost_commits = log.lost_commits;
  found.whole = log.state == LogState::whole && found.missing_documents == 0;
  found.what = interrupted_sentence(found, log, checked->finished);
  return found;
}

std::optional<Recovered> close_in_place(const fs::path& file, const LogReading& log,
                                        const std::string& now_utc) {
  fs::path kept;
  if (log.state == LogState::doubtful) {
    kept = aside_name(file, "unread", now_utc);
    if (auto made = copy_part(file.string() + "-wal", kept.string() + "-wal"); !made)
      return left_alone(file, made.error().what);
  }
  const std::string index = content(file.string() + "-shm");
  auto found = close_checked(file, log, kept, now_utc);
  const bool all_aside = found && !found->aside.empty() && is_there(found->aside) &&
                         found->aside != kept.string() + "-wal";
  if (all_aside && !index.empty()) put_back(index, found->aside.string() + "-shm");
  if (all_aside && !kept.empty()) remove_parts(kept);  // the log itself is set aside
  return found;
}

}  // namespace

std::vector<fs::path> interrupted(const fs::path& directory) {
  std::set<fs::path> files;
  std::error_code trouble;
  for (const auto& entry : fs::directory_iterator(directory, trouble)) {
    const fs::path& path = entry.path();
    if (path.extension() == ".db") files.insert(path);
    if (path.extension() == ".db-wal" && holds_bytes(path)) {
      fs::path file = path;
      files.insert(file.replace_extension(".db"));
    }
  }
  std::vector<fs::path> found;
  for (const auto& file : files) {
    const bool alone = !holds_bytes(file.string() + "-wal") && !is_there(file.string() + "-shm") &&
                       !is_there(file.string() + "-journal");
    if (!alone || !holds_bytes(file) || !looks_finished(file)) found.push_back(file);
  }
  return found;
}

std::optional<Recovered> recover_one(const fs::path& file, const std::string& now_utc) {
  std::error_code trouble;
  if (is_there(file) && !fs::is_regular_file(fs::symlink_status(file, trouble)))
    return left_alone(file, fmt::format("{}: is not a regular file; move it out of the data "
                                        "directory.",
                                        file.string()));
  const LogReading log = read_log(file);
  if (is_void(file, log)) {
    remove_parts(file);
    return std::nullopt;
  }
  // SQLite would remove the log of an empty file.
  if (!holds_bytes(file) && (log.bytes > 0 || log.indexed.value_or(0) > 0))
    return salvage(file, log, now_utc,
                   Error{ErrorKind::invalid,
                         fmt::format("{}: {}.", file.string(),
                                     is_there(file) ? "is empty, and its log is not"
                                                    : "is gone, and its log is still there")});
  if (log.state == LogState::damaged)
    return salvage(
        file, log, now_utc,
        Error{ErrorKind::invalid, fmt::format("{}: its log is damaged.", file.string())});
  return close_in_place(file, log, now_utc);
}

std::vector<Recovered> recover(const fs::path& directory, const std::string& now_utc) {
  std::vector<Recovered> all;
  for (const auto& file : interrupted(directory)) {
    if (auto found = recover_one(file, now_utc)) all.push_back(std::move(*found));
  }
  return all;
}

}  // namespace shaker::record
