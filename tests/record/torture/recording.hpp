// A campaign whose every commit is known, and the judge of what recovery makes of its remains.
//
// Commit i holds document i + 1, eight samples and a cycle, all made from i. What was acknowledged
// is a number: the commits that had returned.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "record/campaign_database.hpp"
#include "record/recovery.hpp"

namespace shaker::record::torture {

inline constexpr const char* kNow = "2026-03-01T12:01:00.000Z";
inline constexpr int kSamples = 8;

Result<void> add_commit(CampaignWriter& writer, int i);

// The content of a campaign's files by what follows ".db" in their names: "", "-wal", "-shm".
using Remains = std::map<std::string, std::string>;
Remains remains_of(const std::filesystem::path& file);
// Writes them as DIRECTORY/c.db.
std::filesystem::path lay(const Remains& remains, const std::filesystem::path& directory);

// A campaign that is left behind after `commits`, folded in once after `folded` of them (0: never).
Remains left_behind(int commits, int folded);

struct Verdict {
  std::string violation;  // empty: all is as it must be
  std::int64_t read = 0;  // of the acknowledged documents
  bool damaged = false, whole = false, told = false;
};

// Recovers the campaign in `file`'s directory and asks: is everything that is read as it was
// written, is everything that was acknowledged read or counted as lost, is nothing called whole
// that is not, is every byte still there that could not be read? Where an end is missing it is
// enough to say that it may be.
enum class End { there, missing };
Verdict judge(const std::filesystem::path& file, const Remains& before, int acknowledged,
              End end = End::there);

}  // namespace shaker::record::torture
