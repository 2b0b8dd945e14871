// Power cuts that lose or tear unflushed data, and a disk whose n-th call fails.
#include <cstdio>
#include <optional>

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "tests/record/scratch.hpp"
#include "tests/record/torture/effort.hpp"
#include "tests/record/torture/faulty_disk.hpp"
#include "tests/record/torture/recording.hpp"

namespace shaker::record::torture {
namespace {

using testing::example_campaign;
using testing::Scratch;

void fold(const std::filesystem::path& file) {
  try {
    SQLite::Database(file.string(), SQLite::OPEN_READWRITE).exec("PRAGMA wal_checkpoint(PASSIVE)");
  } catch (const SQLite::Exception&) {
    // The disk failed: the commits are in the log.
  }
}

// Cuts the power at random moments of a campaign and reports violations.
class PowerCuts {
 public:
  explicit PowerCuts(std::uint64_t seed) : random_(seed) {}

  // Writes a campaign and evaluates `cuts` power cuts.
  void campaign(int cuts) {
    const Scratch scratch(Scratch::in_memory);
    disk_.remember(true);
    record(scratch.path());
    disk_.remember(false);
    for (int i = 0; i < cuts; ++i)
      cut();
  }
  void tell() const {
    std::printf(
        "%d power cuts, %d documents acknowledged before, %d lost; %d told as damaged, "
        "%d called whole\n",
        tried_, acknowledged_, lost_, damaged_, whole_);
  }
  int lost() const { return lost_; }

 private:
  void record(const std::filesystem::path& directory) {
    returned_.clear();
    auto writer = CampaignWriter::create(directory, example_campaign());
    ASSERT_TRUE(writer) << writer.error().what;
    const int commits = 10 + static_cast<int>(random_() % 30);
    for (int i = 0; i < commits; ++i) {
      ASSERT_TRUE(add_commit(*writer, i));
      returned_.push_back(disk_.moment());
      if (random_() % 12 == 0) fold(writer->file());
    }
    if (random_() % 3 == 0) {
      ASSERT_TRUE(writer->finish("success", kNow));
    }
  }

  void cut() {
    const std::size_t moment = random_() % (disk_.moment() + 1);
    const auto acknowledged = static_cast<int>(
        std::ranges::count_if(returned_, [moment](std::size_t at) { return at <= moment; }));
    const Remains remains = disk_.after_power_cut(moment, random_);
    const Scratch scratch(Scratch::in_memory);
    const Verdict verdict = judge(lay(remains, scratch.path()), remains, acknowledged);
    EXPECT_EQ(verdict.violation, "") << "moment " << moment << " of " << disk_.moment();
    EXPECT_GE(verdict.read, acknowledged) << "moment " << moment << " of " << disk_.moment();
    ++tried_;
    acknowledged_ += acknowledged;
    lost_ += std::max(0, acknowledged - static_cast<int>(verdict.read));
    damaged_ += verdict.damaged ? 1 : 0;
    whole_ += verdict.whole ? 1 : 0;
  }

  FaultyDisk& disk_ = FaultyDisk::install();
  std::mt19937_64 random_;
  std::vector<std::size_t> returned_;  // the moment at which each commit returned
  int tried_ = 0, acknowledged_ = 0, lost_ = 0, damaged_ = 0, whole_ = 0;
};

TEST(PowerCut, LosesNothingThatWasAcknowledged) {
  PowerCuts cuts(effort().seed);
  const int wanted = effort().count > 0 ? effort().count : 60;
  for (int done = 0; done < wanted; done += 20)
    cuts.campaign(std::min(20, wanted - done));
  cuts.tell();
  EXPECT_EQ(cuts.lost(), 0);
}

// Writes until something fails. Returns the number of acknowledged commits.
struct Written {
  int acknowledged = 0;
  bool failed = false;
  std::filesystem::path file;
};
Written write_campaign(const std::filesystem::path& directory, int commits) {
  Written written;
  auto writer = CampaignWriter::create(directory, example_campaign());
  if (!writer) {
    EXPECT_NE(writer.error().what.find(".db"), std::string::npos) << writer.error().what;
    written.failed = true;
    return written;
  }
  written.file = writer->file();
  for (int i = 0; i < commits; ++i) {
    const auto done = add_commit(*writer, i);
    if (!done) {
      EXPECT_NE(done.error().what.find(".db"), std::string::npos) << done.error().what;
      written.failed = true;
      return written;
    }
    written.acknowledged = i + 1;
    if (i == commits / 2) fold(writer->file());
  }
  written.failed = !writer->finish("success", kNow);
  return written;
}

void expect_kept(const std::filesystem::path& directory, const Written& written,
                 const std::string& what) {
  const Remains remains = written.file.empty() ? Remains{} : remains_of(written.file);
  if (written.file.empty()) {
    for (const auto& found : recover(directory, kNow))
      EXPECT_FALSE(found.damaged) << what << ": " << found.what;
    return;
  }
  const Verdict verdict = judge(written.file, remains, written.acknowledged);
  EXPECT_EQ(verdict.violation, "") << what;
  EXPECT_GE(verdict.read, written.acknowledged) << what;
  EXPECT_FALSE(verdict.damaged) << what;
}

TEST(FailingDisk, EveryCallOnceAndForGood) {
  FaultyDisk& disk = FaultyDisk::install();
  const int commits = effort().count > 0 ? 30 : 3;
  for (const bool for_good : {false, true}) {
    for (const int code : {SQLITE_IOERR_WRITE, SQLITE_FULL}) {
      if (effort().count == 0 && for_good == (code == SQLITE_FULL)) continue;
      std::int64_t n = 0;
      int failed = 0;
      for (bool reached = true; reached;) {
        const Scratch scratch(Scratch::in_memory);
        disk.fail_at(++n, for_good, code);
        const Written written = write_campaign(scratch.path(), commits);
        reached = disk.reached();
        disk.fail_at(0, false, SQLITE_OK);
        failed += written.failed ? 1 : 0;
        expect_kept(scratch.path(), written,
                    fmt::format("call {} fails, for good {}", n, for_good));
        if (!reached) {
          EXPECT_FALSE(written.failed);
        }
      }
      std::printf("%ld calls, each failed %s with %d: %d were told as an Error\n",
                  static_cast<long>(n - 1), for_good ? "for good" : "once", code, failed);
      EXPECT_GT(n, 40);
    }
  }
}

// The caller may try again after an Error: a later acknowledgement must hold too.
TEST(FailingDisk, ACommitAfterAnErrorHolds) {
  FaultyDisk& disk = FaultyDisk::install();
  for (std::int64_t n = 1; n < 80; n += 3) {
    const Scratch scratch(Scratch::in_memory);
    auto writer = CampaignWriter::create(scratch.path(), example_campaign());
    ASSERT_TRUE(writer);
    std::vector<std::string> acknowledged;
    disk.fail_at(n, false, SQLITE_IOERR_WRITE);
    for (int i = 0; i < 12; ++i) {
      const std::string line = fmt::format("document {}", i);
      auto done = writer->add_document(static_cast<std::uint64_t>(i) + 1, line);
      if (done) done = writer->commit();
      if (done) acknowledged.push_back(line);
    }
    disk.fail_at(0, false, SQLITE_OK);
    EXPECT_GE(acknowledged.size(), 10U);
    const auto reader = CampaignReader::open(writer->file());
    ASSERT_TRUE(reader) << reader.error().what;
    EXPECT_THAT(*reader->documents(), ::testing::IsSupersetOf(acknowledged)) << "call " << n;
  }
}

}  // namespace
}  // namespace shaker::record::torture
