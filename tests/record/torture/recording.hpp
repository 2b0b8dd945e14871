// A campaign in which every commit is known, and the check of its recovery.
//
// Commit i has document i + 1, eight samples and a cycle, all derived from i. The number of
// commits that returned gives what was acknowledged.
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

// The content of a campaign's files by the suffix after ".db" in their names: "", "-wal",
// "-shm".
using Remains = std::map<std::string, std::string>;
Remains remains_of(const std::filesystem::path& file);
// Writes them as DIRECTORY/c.db and its companions.
std::filesystem::path lay(const Remains& remains, const std::filesystem::path& directory);

// An unfinished campaign after `commits` commits, checkpointed once after `folded` (0: never).
Remains left_behind(int commits, int folded);

struct Verdict {
  std::string violation;  // empty: no violation
  std::int64_t read = 0;  // of the acknowledged documents
  bool damaged = false, whole = false, told = false;
};

// Recovers the campaign in the directory of `file` and checks: all read data are as written;
// all acknowledged data are read or counted as lost; nothing damaged is called whole; every
// unreadable byte is still there. When the end is missing, it suffices that recovery says it
// may be.
enum class End { there, missing };
Verdict judge(const std::filesystem::path& file, const Remains& before, int acknowledged,
              End end = End::there);

}  // namespace shaker::record::torture
