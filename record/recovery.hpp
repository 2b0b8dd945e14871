// What a daemon that died left behind: found, counted, marked, and never in the way of starting.
//
// Nothing that was written is removed. A log that cannot be read to its end is kept under another
// name before SQLite may fold what it reads of it into the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::record {

struct Recovered {
  std::filesystem::path file;   // what can be read; `aside` where nothing can
  std::filesystem::path aside;  // as it was found, with -wal and -shm; empty: nothing was set aside
  std::string campaign;         // empty when it could not be read
  bool damaged = false;         // something that was committed cannot be read
  bool whole = false;           // all that was committed can be read, and the log's index says so
  std::int64_t runs = 0, samples = 0, cycles = 0, documents = 0;
  std::int64_t last_document = 0, missing_documents = 0;  // the highest number, and gaps below it
  std::int64_t unsound_rows = 0;  // did not fit their checksum and were left out
  std::int64_t lost_commits = 0;  // at most; 0 where nothing says that any is lost
  std::string what;               // a sentence for the operator
};

// The campaigns in `directory` that look as if they had not been finished, and logs without a file.
// Reads a page or two of each file and changes nothing. Precondition: nothing is recorded there.
std::vector<std::filesystem::path> interrupted(const std::filesystem::path& directory);

// Checks one of them: about a second for each gigabyte; any thread. A campaign that never finished
// is counted and marked `interrupted`; what cannot be read is renamed to FILE.damaged-UTC, with its
// log and index beside it, and FILE holds again what could be read, if anything. Nothing: it is
// finished, of a newer version, or not a byte was ever written. `now_utc` as format_utc gives it.
// Precondition: nobody records it, and no other thread of this process has it open.
std::optional<Recovered> recover_one(const std::filesystem::path& file, const std::string& now_utc);

// Both at once.
std::vector<Recovered> recover(const std::filesystem::path& directory, const std::string& now_utc);

}  // namespace shaker::record
