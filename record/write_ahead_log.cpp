#include "record/write_ahead_log.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/unique_fd.hpp"

namespace shaker::record {
namespace {

constexpr std::size_t kLogHeader = 32, kFrameHeader = 24;
constexpr std::size_t kUsualPage = 4096;         // page size of campaigns
constexpr std::uint32_t kLogMagic = 0x377f0682;  // last bit: checksums of big-endian words

using Bytes = std::span<const unsigned char>;
using Pair = std::pair<std::uint32_t, std::uint32_t>;  // two salts, or two halves of a checksum

std::uint32_t big_endian(Bytes bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} << 24 | std::uint32_t{bytes[at + 1]} << 16 |
         std::uint32_t{bytes[at + 2]} << 8 | std::uint32_t{bytes[at + 3]};
}

std::uint32_t native(Bytes bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

Pair big_endian_pair(Bytes bytes, std::size_t at) {
  return {big_endian(bytes, at), big_endian(bytes, at + 4)};
}

// Checksum of a multiple of 8 bytes, continued from `sum`.
Pair checksum(Bytes bytes, Pair sum, bool big_words) {
  for (std::size_t i = 0; i + 8 <= bytes.size(); i += 8) {
    sum.first += (big_words ? big_endian(bytes, i) : native(bytes, i)) + sum.second;
    sum.second += (big_words ? big_endian(bytes, i + 4) : native(bytes, i + 4)) + sum.first;
  }
  return sum;
}

// A regular file that is read at any position; any other file counts as absent.
class RegularFile {
 public:
  explicit RegularFile(const std::string& path)
      : fd_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW)) {
    struct stat status {};
    if (fd_.valid() && ::fstat(fd_.get(), &status) == 0 && S_ISREG(status.st_mode))
      size_ = status.st_size;
  }
  std::int64_t size() const { return size_; }
  bool read(std::int64_t where, std::span<unsigned char> bytes) const {
    return size_ >= where + static_cast<std::int64_t>(bytes.size()) &&
           ::pread(fd_.get(), bytes.data(), bytes.size(), where) ==
               static_cast<ssize_t>(bytes.size());
  }

 private:
  UniqueFd fd_;
  std::int64_t size_ = 0;
};

struct LogHeader {
  bool fits = false, big_words = false;
  bool first_generation = false;  // the log never restarted, so no frame is an old one
  std::size_t page = kUsualPage;
  Pair salts, sum;
};

LogHeader read_header(const RegularFile& log) {
  LogHeader header;
  std::array<unsigned char, kLogHeader> bytes{};
  if (!log.read(0, bytes)) return header;
  const std::uint32_t magic = big_endian(bytes, 0), page = big_endian(bytes, 8);
  header.big_words = (magic & 1) != 0;
  header.sum = checksum(Bytes(bytes).first(24), {}, header.big_words);
  header.fits = (magic & ~1U) == kLogMagic && page >= 512 && page <= 65536 &&
                (page & (page - 1)) == 0 && header.sum == big_endian_pair(bytes, 24);
  if (!header.fits) return header;
  header.page = page;
  header.first_generation = big_endian(bytes, 12) == 0;
  header.salts = big_endian_pair(bytes, 16);
  return header;
}

struct LogFrame {
  bool commit = false;
  Pair salts;
  bool sound = false;  // this frame and all before it are valid
};

std::vector<LogFrame> read_frames(const RegularFile& log, const LogHeader& header) {
  std::vector<LogFrame> frames;
  std::vector<unsigned char> bytes(kFrameHeader + header.page);
  const auto step = static_cast<std::int64_t>(bytes.size());
  Pair sum = header.sum;
  bool sound = header.fits;
  for (std::int64_t at = kLogHeader; log.read(at, bytes); at += step) {
    LogFrame frame;
    const Bytes all(bytes);
    frame.commit = big_endian(all, 4) != 0;
    frame.salts = big_endian_pair(all, 8);
    if (sound) {
      sum = checksum(all.first(8), sum, header.big_words);
      sum = checksum(all.subspan(kFrameHeader), sum, header.big_words);
      sound =
          frame.salts == header.salts && big_endian(all, 0) != 0 && sum == big_endian_pair(all, 16);
    }
    frame.sound = sound;
    frames.push_back(frame);
  }
  return frames;
}

struct LogIndex {
  std::int64_t committed = 0, folded = 0;
  Pair salts;
};

// Both copies of the index's header must be equal and match their checksum.
std::optional<LogIndex> read_index(const RegularFile& shm) {
  constexpr std::size_t kCopy = 48, kFolded = 96;
  std::array<unsigned char, 136> bytes{};
  if (!shm.read(0, bytes)) return std::nullopt;
  const Bytes first = Bytes(bytes).first(kCopy), second = Bytes(bytes).subspan(kCopy, kCopy);
  const bool initialised = first[12] != 0;
  const Pair sum = checksum(first.first(40), {}, false);
  if (!initialised || !std::ranges::equal(first, second) ||
      sum != Pair{native(first, 40), native(first, 44)})
    return std::nullopt;
  // The salts have the byte order of the log, everything else that of the memory.
  return LogIndex{native(first, 16), native(bytes, kFolded), big_endian_pair(first, 32)};
}

// The salts of the header; without it, those of the index, or the most frequent ones of the
// frames.
Pair salts_of(const LogHeader& header, const std::optional<LogIndex>& index,
              const std::vector<LogFrame>& frames) {
  if (header.fits) return header.salts;
  std::map<Pair, int> seen;
  for (const LogFrame& frame : frames)
    ++seen[frame.salts];
  if (index && seen.contains(index->salts)) return index->salts;
  seen.erase({0, 0});
  if (seen.empty()) return {};
  return std::ranges::max_element(seen, {}, [](const auto& entry) { return entry.second; })->first;
}

// An earlier generation differs in both salts. A frame with one matching salt is a damaged
// frame of this generation, and so is every foreign frame if there was no other generation.
bool is_old(const LogFrame& frame, const LogHeader& header, const Pair& salts) {
  if (frame.sound || salts == Pair{} || frame.salts == Pair{}) return false;
  if (header.fits && header.first_generation) return false;
  return frame.salts.first != salts.first && frame.salts.second != salts.second;
}

// Counts the unread frames that may have been a commit: those with a commit mark, those of
// which nothing is known, and the first, whose mark may be damaged.
void count_lost(LogReading& log, const std::vector<LogFrame>& frames, const Pair& salts) {
  std::int64_t first_marked = 0;
  for (std::int64_t i = log.sound; i < log.frames; ++i) {
    const LogFrame& frame = frames[static_cast<std::size_t>(i)];
    const bool known = frame.salts == salts && salts != Pair{};
    if (frame.commit || !known || i == log.sound) ++log.lost_commits;
    if (frame.commit && known && first_marked == 0) first_marked = i + 1;
  }
  if (log.indexed) log.lost_commits += std::max<std::int64_t>(0, *log.indexed - log.frames);
  // A commit is on disk before the next one begins, so a frame after it proves that it was one.
  log.lost_for_certain = first_marked > 0 && first_marked < log.frames;
}

LogState judged(const LogReading& log) {
  if (log.indexed) {
    if (*log.indexed > std::max(log.readable, *log.folded)) return LogState::damaged;
    // With such a log, the file would return to older pages.
    if (*log.folded > log.readable && log.frames > 0) return LogState::damaged;
  }
  if (log.bytes <= static_cast<std::int64_t>(kLogHeader)) return LogState::none;
  if (!log.header_fits || log.lost_for_certain) return LogState::damaged;
  if (log.frames > log.sound) return LogState::doubtful;
  if (log.indexed && *log.indexed == log.readable) return LogState::whole;
  if (log.cut_frame || log.sound > log.readable) return LogState::doubtful;
  return log.indexed ? LogState::whole : LogState::no_index;
}

}  // namespace

LogReading read_log(const std::filesystem::path& file) {
  const RegularFile log(file.string() + "-wal"), shm(file.string() + "-shm");
  const LogHeader header = read_header(log);
  const auto frames = read_frames(log, header);
  const auto index = read_index(shm);
  const Pair salts = salts_of(header, index, frames);
  LogReading reading;
  reading.bytes = log.size();
  reading.header_fits = header.fits;
  std::int64_t number = 0;
  for (const LogFrame& frame : frames) {
    ++number;
    if (!is_old(frame, header, salts)) reading.frames = number;
    if (!frame.sound) continue;
    reading.sound = number;
    if (!frame.commit) continue;
    reading.readable = number;
    ++reading.readable_commits;
  }
  const auto end = static_cast<std::int64_t>(kLogHeader) +
                   number * static_cast<std::int64_t>(kFrameHeader + header.page);
  reading.cut_frame = log.size() > end;
  if (index && (index->salts == salts || salts == Pair{})) {
    reading.indexed = index->committed;
    reading.folded = index->folded;
  }
  count_lost(reading, frames, salts);
  reading.state = judged(reading);
  const bool unread = reading.state == LogState::damaged || reading.state == LogState::doubtful;
  reading.lost_commits = unread ? std::max<std::int64_t>(reading.lost_commits, 1) : 0;
  return reading;
}

}  // namespace shaker::record
