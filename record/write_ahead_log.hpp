// What a campaign's write-ahead log holds, read without SQLite and without changing a byte.
//
// SQLite reads a log up to the first frame that does not fit and says nothing about the rest: a
// torn end and a damaged middle look the same to it. Recovery must know which it is before SQLite
// folds the log into the file. Formats: sqlite.org/fileformat2.html (4, the log) and
// sqlite.org/walformat.html (2, its index in FILE-shm). No other thread of this process may have
// the campaign open: closing a file drops this process's locks on it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

namespace shaker::record {

enum class LogState {
  none,      // there is no log, or it holds no frame: all that is known is in the file
  whole,     // all that was committed can be read: the log's index says so
  no_index,  // all that it holds can be read; nothing says whether its end is missing
  doubtful,  // its end cannot be read: a write that was under way, or the last commit
  damaged    // what was committed cannot be read
};

struct LogReading {
  std::int64_t bytes = 0;     // of the log; 0 also when there is none
  bool header_fits = false;   // without it SQLite reads no frame at all
  std::int64_t frames = 0;    // on file, by their salts; not those of earlier generations
  std::int64_t sound = 0;     // frames from the start on whose checksums fit
  std::int64_t readable = 0;  // of these up to the last commit
  std::int64_t readable_commits = 0;
  // What was committed and cannot be read, at most: a commit's mark may itself be damaged.
  std::int64_t lost_commits = 0;
  bool lost_for_certain = false;  // further frames follow a commit that cannot be read
  // Frames that were committed, and frames that are in the file as well, by the log's index.
  std::optional<std::int64_t> indexed, folded;
  bool cut_frame = false;  // the log ends within a frame
  LogState state = LogState::none;
};

// Of the campaign `file`, from `file`-wal and `file`-shm.
LogReading read_log(const std::filesystem::path& file);

}  // namespace shaker::record
