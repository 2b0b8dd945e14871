// All kinds of damage to the files of a dead writer: bits, ends, zeroed files, missing files.
#include <cstdio>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/record/scratch.hpp"
#include "tests/record/torture/effort.hpp"
#include "tests/record/torture/recording.hpp"

namespace shaker::record::torture {
namespace {

using testing::Scratch;

constexpr std::size_t kLogHead = 32, kFrame = 24 + 4096, kPage = 4096;

struct Tally {
  int tried = 0, damaged = 0, whole = 0, told = 0;
  ~Tally() {
    std::printf("%d damages: %d told, %d of them as damaged, %d called whole\n", tried, told,
                damaged, whole);
  }
};

// The remains must contain `acknowledged` documents, whatever the damage.
Verdict expect_honest(const Remains& remains, int acknowledged, const std::string& what,
                      Tally& tally, End end = End::there) {
  const Scratch scratch(Scratch::in_memory);
  const Verdict verdict = judge(lay(remains, scratch.path()), remains, acknowledged, end);
  EXPECT_EQ(verdict.violation, "") << what;
  ++tally.tried;
  tally.damaged += verdict.damaged ? 1 : 0;
  tally.whole += verdict.whole ? 1 : 0;
  tally.told += verdict.told ? 1 : 0;
  return verdict;
}

Remains flipped(Remains remains, const std::string& part, std::size_t bit) {
  char& byte = remains[part][bit / 8];
  byte = static_cast<char>(byte ^ (1 << (bit % 8)));
  return remains;
}

// With the index of the log, and without it.
std::vector<Remains> kinds(const Remains& remains) {
  Remains without = remains;
  without.erase("-shm");
  return {remains, without};
}

TEST(Undamaged, IsWholeWithItsIndexAndNotCalledSoWithout) {
  Tally tally;
  for (const int folded : {0, 9}) {
    const Remains remains = left_behind(12, folded);
    EXPECT_TRUE(expect_honest(remains, 12, "with", tally).whole);
    Remains without = remains;
    without.erase("-shm");
    const Verdict verdict = expect_honest(without, 12, "without", tally);
    EXPECT_FALSE(verdict.whole);
    EXPECT_FALSE(verdict.damaged);
    EXPECT_EQ(verdict.read, 12);
  }
}

TEST(DamagedLog, EveryFrameWithABitFlipped) {
  Tally tally;
  std::mt19937_64 random(effort().seed);
  const int commits = effort().count > 0 ? 40 : 12;
  for (const int folded : {0, commits / 2}) {
    const Remains remains = left_behind(commits, folded);
    const std::size_t frames = (remains.at("-wal").size() - kLogHead) / kFrame;
    ASSERT_GT(frames, 20U);
    for (std::size_t frame = 0; frame < frames; ++frame) {
      const std::size_t at = kLogHead + frame * kFrame;
      for (const Remains& kind : kinds(remains)) {
        // One bit of the frame's header and one of its page; the short form takes them
        // alternately.
        const bool both = effort().count > 0;
        if (both || (frame + kind.size()) % 2 == 0)
          expect_honest(flipped(kind, "-wal", 8 * at + random() % (8 * 24)), commits,
                        fmt::format("header of frame {}", frame), tally);
        if (both || (frame + kind.size()) % 2 == 1)
          expect_honest(flipped(kind, "-wal", 8 * (at + 24) + random() % (8 * kPage)), commits,
                        fmt::format("page of frame {}", frame), tally);
      }
    }
  }
}

TEST(DamagedLog, EveryByteOfItsHeader) {
  Tally tally;
  for (const int folded : {0, 3}) {
    const Remains remains = left_behind(6, folded);
    for (std::size_t byte = 0; byte < kLogHead; ++byte) {
      for (const Remains& kind : kinds(remains)) {
        const auto verdict = expect_honest(flipped(kind, "-wal", 8 * byte + byte % 8), 6,
                                           fmt::format("byte {} of the log", byte), tally);
        EXPECT_TRUE(verdict.damaged) << byte;
      }
    }
  }
}

TEST(DamagedLog, CutAtEveryFrameAndAboutIt) {
  Tally tally;
  const int commits = effort().count > 0 ? 40 : 5;
  for (const int folded : {0, commits / 2}) {
    const Remains remains = left_behind(commits, folded);
    const std::size_t size = remains.at("-wal").size();
    for (std::size_t at = 0; at <= size; at += at == 0 ? kLogHead : kFrame) {
      for (const int beside : {-25, -1, 0, 1, 24}) {
        const auto end = static_cast<std::int64_t>(at) + beside;
        if (end < 0 || end > static_cast<std::int64_t>(size)) continue;
        for (Remains kind : kinds(remains)) {
          kind["-wal"].resize(static_cast<std::size_t>(end));
          expect_honest(kind, commits, fmt::format("cut at {} of {}", end, size), tally,
                        End::missing);
        }
      }
    }
  }
}

TEST(DamagedLog, ZerosFromEachPlaceOn) {
  Tally tally;
  const Remains remains = left_behind(10, 0);
  const std::size_t size = remains.at("-wal").size();
  for (std::size_t at = 0; at < size; at += 3 * kFrame + 1000) {
    for (Remains kind : kinds(remains)) {
      kind["-wal"].replace(at, size - at, size - at, '\0');
      const auto verdict =
          expect_honest(kind, 10, fmt::format("zeros from {} of {}", at, size), tally);
      EXPECT_FALSE(verdict.whole);
    }
  }
}

TEST(DamagedFile, ABitOfItsPagesFlipped) {
  Tally tally;
  std::mt19937_64 random(effort().seed);
  const int flips = effort().count > 0 ? effort().count : 120;
  // All commits in the file after the last checkpoint, or half of them in the log.
  for (const int folded : {16, 8}) {
    const Remains remains = left_behind(16, folded);
    const std::size_t pages = remains.at("").size() / kPage;
    ASSERT_GT(pages, 5U);
    for (int i = 0; i < flips / 2; ++i) {
      // Every page in turn; on the first page mostly its header of 100 bytes.
      const std::size_t page = static_cast<std::size_t>(i) % pages;
      const std::size_t within = page == 0 ? random() % 800 : random() % (8 * kPage);
      const std::size_t bit = 8 * page * kPage + within;
      Remains damaged = flipped(remains, "", bit);
      if (folded == 16) damaged["-wal"].clear();  // as SQLite leaves it after a full checkpoint
      expect_honest(damaged, 16, fmt::format("bit {} of page {}", within, page + 1), tally);
    }
  }
}

TEST(DamagedFile, OfZerosEmptyOrGone) {
  Tally tally;
  for (const int folded : {0, 8}) {
    for (const std::string part : {"", "-wal", "-shm"}) {
      for (const Remains& kind : kinds(left_behind(16, folded))) {
        if (!kind.contains(part)) continue;
        Remains zeros = kind, empty = kind, gone = kind;
        zeros[part].assign(kind.at(part).size(), '\0');
        empty[part].clear();
        gone.erase(part);
        for (const auto& [what, damaged] : std::vector<std::pair<std::string, Remains>>{
                 {"zeros", zeros}, {"empty", empty}, {"gone", gone}})
          expect_honest(damaged, 16, fmt::format("{} is {}, folded {}", part, what, folded), tally,
                        what == "zeros" ? End::there : End::missing);
      }
    }
  }
}

}  // namespace
}  // namespace shaker::record::torture
