// Where the numbers of a campaign come from: the files, programs and people that made them, the
// specimen, the sensors, and notes. Each is a Fact, a row of the table `fact`, with the SHA-256 of
// its value. Databases of layouts before 4 have none, until a note is added.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"

namespace shaker::record {

struct Fact {
  std::string kind;         // "rig_file", "program", "person", "specimen", "sensor", "note", ...
  std::string name;         // of a file: its path
  std::string value;        // of a file: its whole text
  std::string utc = {};     // when it was written; the writer fills in an empty one
  std::string sha256 = {};  // of the value, as it is in the file; the writer computes it
};

// SHA-256 in hexadecimal.
std::string sha256(std::string_view text);
// True if the hash in the file is that of the value.
bool holds(const Fact& fact);

// Adds a note to a campaign that has ended, of any layout. One transaction, flushed. An Error names
// the file and the remedy: no permission, or the campaign is still being recorded. Waits for the
// disk.
Result<void> add_note(const std::filesystem::path& file, const Fact& note);

}  // namespace shaker::record
