// Examines the write-ahead log of a campaign, without SQLite and without changing a byte.
//
// SQLite reads a log up to the first invalid frame and does not report the rest, so it treats
// an incomplete end and a damaged middle alike. Recovery must distinguish them before SQLite
// folds the log into the file. Formats: sqlite.org/fileformat2.html (4, the log) and
// sqlite.org/walformat.html (2, its index in FILE-shm). No other thread of this process may
// have the campaign open, because closing a file releases this process's locks on it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace shaker::record {

enum class LogState {
  none,      // no log, or no frame in it: only the file is known
  whole,     // all committed data can be read, by the log's index
  no_index,  // all its frames can be read; its end may be missing
  doubtful,  // its end cannot be read: an unfinished write, or the last commit
  damaged    // committed data cannot be read
};

struct LogReading {
  std::int64_t bytes = 0;     // of the log; also 0 if there is none
  bool header_fits = false;   // otherwise SQLite reads no frame at all
  std::int64_t frames = 0;    // in the file, by their salts, without earlier generations
  std::int64_t sound = 0;     // frames from the start with valid checksums
  std::int64_t readable = 0;  // of these, up to the last commit
  std::int64_t readable_commits = 0;
  // Upper limit of the lost commits: a commit's mark may itself be damaged.
  std::int64_t lost_commits = 0;
  bool lost_for_certain = false;  // further frames follow a commit that cannot be read
  // Frames that were committed, and frames that are already in the file, according to the log's
  // index.
  std::optional<std::int64_t> indexed, folded;
  bool cut_frame = false;  // the log ends within a frame
  LogState state = LogState::none;
};

// Examines `file`-wal and `file`-shm of the campaign `file`.
LogReading read_log(const std::filesystem::path& file);

}  // namespace shaker::record
