// Recovers the campaigns of a daemon that died: finds, counts and marks them.
//
// Contents are never removed. A log that cannot be read to its end is kept under another name
// before SQLite may fold its readable part into the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::record {

struct Recovered {
  std::filesystem::path file;   // the readable file; `aside` if none is
  std::filesystem::path aside;  // the original, with -wal and -shm; empty: nothing was set aside
  std::string campaign;         // empty if it could not be read
  bool damaged = false;         // committed data cannot be read
  bool whole = false;           // all committed data can be read, by the log's index
  std::int64_t runs = 0, samples = 0, cycles = 0, documents = 0;
  std::int64_t last_document = 0, missing_documents = 0;  // highest number; gaps below it
  std::int64_t unsound_rows = 0;  // removed, because they did not match their checksum
  std::int64_t lost_commits = 0;  // upper limit; 0 without any sign of a loss
  std::string what;               // a sentence for the operator
};

// The campaigns in `directory` that look unfinished, and logs without a file. Reads a page or
// two of each file and changes nothing. Precondition: nothing is being recorded there.
std::vector<std::filesystem::path> interrupted(const std::filesystem::path& directory);

// Checks one of them; takes about a second for each gigabyte; any thread. An unfinished
// campaign is counted and marked `interrupted`. A damaged one is renamed to FILE.damaged-UTC,
// with its log and index, and FILE then has the readable contents, if any. Returns nothing if
// the campaign is finished (also in a newer version) or nothing was ever written. `now_utc` as
// from format_utc. Precondition: nobody records it, and no other thread of this process has it
// open.
std::optional<Recovered> recover_one(const std::filesystem::path& file, const std::string& now_utc);

// Calls recover_one for all of them.
std::vector<Recovered> recover(const std::filesystem::path& directory, const std::string& now_utc);

}  // namespace shaker::record
