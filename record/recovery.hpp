// What a daemon that died left behind: found, counted, marked, and never in the way of starting.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.hpp"

namespace shaker::record {

struct Recovered {
  std::filesystem::path file;  // where it is now
  std::string campaign;        // empty when it could not be read
  bool damaged = false;        // set aside: `file` is its new name
  std::int64_t runs = 0, samples = 0, cycles = 0, documents = 0;
  std::string what;  // a sentence for the operator
};

// Looks at every campaign in `directory`. One that never finished is checked, counted and marked
// `interrupted`; one that cannot be read is renamed to FILE.damaged-UTC, with its log beside it.
// Files of a newer version and finished campaigns are left alone. `now_utc` as format_utc gives it.
// Precondition: no other daemon writes there (it holds the directory's lock).
std::vector<Recovered> recover(const std::filesystem::path& directory, const std::string& now_utc);

}  // namespace shaker::record
