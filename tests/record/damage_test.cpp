// Damaged files: recovery reports them in a sentence, sets them aside, and continues.
#include <fstream>

#include <SQLiteCpp/SQLiteCpp.h>
#include <sys/mount.h>
#include <unistd.h>

#include "record/recovery.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::record {
namespace {

using testing::example_campaign;
using ::testing::HasSubstr;
using testing::Scratch;

constexpr const char* kNow = "2026-03-01T12:01:00.000Z";

// An unfinished campaign of some size.
std::filesystem::path write_campaign(const std::filesystem::path& directory) {
  auto writer = CampaignWriter::create(directory, example_campaign());
  for (std::uint64_t i = 0; i < 200; ++i) {
    EXPECT_TRUE(writer->add_document(i, std::string(500, 'd')));
  }
  EXPECT_TRUE(writer->commit());
  return writer->file();
}

void overwrite(const std::filesystem::path& file, std::streamoff where, std::size_t count) {
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(where);
  stream << std::string(count, '\x5a');
}

TEST(OlderCampaign, OfBeforeTheAuxiliaryChannelsIsReadAsBefore) {
  const Scratch scratch;
  auto writer = CampaignWriter::create(scratch.path(), testing::example_campaign());
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->add_cycle({0, 3, true, 2.5, 3.25, {0.1, 0.2}, {}, 1e-3}));
  ASSERT_TRUE(writer->finish("success", "2026-03-01T12:05:00.000Z"));
  const auto file = writer->file();
  {
    SQLite::Database old(file.string(), SQLite::OPEN_READWRITE);
    old.exec(
        "DROP TABLE channel; ALTER TABLE cycle DROP COLUMN excitation_error;"
        "PRAGMA user_version=1");
  }
  const auto reader = CampaignReader::open(file);
  ASSERT_TRUE(reader) << reader.error().what;
  const auto row = reader->campaign();
  ASSERT_TRUE(row) << row.error().what;
  EXPECT_EQ(row->name, "first light");
  EXPECT_TRUE(row->auxiliary.empty());
  const auto cycles = reader->cycles(0);
  ASSERT_TRUE(cycles) << cycles.error().what;
  ASSERT_EQ(cycles->size(), 1u);
  EXPECT_EQ(cycles->front().amplitude, 3.25);
  EXPECT_EQ(cycles->front().excitation_error, 0.0);
}

TEST(Reader, TellsApartWhatIsWrongWithAFile) {
  const Scratch scratch;
  const auto missing = scratch.path() / "missing.db";
  EXPECT_THAT(CampaignReader::open(missing).error().what, HasSubstr("there is no such file"));

  const auto text = scratch.path() / "text.db";
  std::ofstream(text) << std::string(5000, 'a');
  EXPECT_THAT(CampaignReader::open(text).error().what, HasSubstr("not a campaign database"));

  const auto other = scratch.path() / "other.db";
  SQLite::Database(other.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE)
      .exec("CREATE TABLE t(x)");
  EXPECT_THAT(CampaignReader::open(other).error().what, HasSubstr("not a campaign database"));

  const auto newer = write_campaign(scratch.path());
  SQLite::Database(newer.string(), SQLite::OPEN_READWRITE).exec("PRAGMA user_version=99");
  const auto refused = CampaignReader::open(newer);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("newer shakerd (layout 99"));
  EXPECT_THAT(refused.error().what, HasSubstr(newer.string()));

  const auto damaged = write_campaign(scratch.path());
  overwrite(damaged, 8192, 20000);
  EXPECT_THAT(CampaignReader::open(damaged).error().what, HasSubstr("is damaged"));
}

TEST(Recovery, SetsADamagedFileAsideAndLeavesTheOthersAlone) {
  const Scratch scratch;
  const auto damaged = write_campaign(scratch.path());
  overwrite(damaged, 8192, 20000);
  const auto text = scratch.path() / "zz.db";
  std::ofstream(text) << std::string(5000, 'a');
  const auto newer = write_campaign(scratch.path());
  SQLite::Database(newer.string(), SQLite::OPEN_READWRITE).exec("PRAGMA user_version=99");
  const auto finished = write_campaign(scratch.path());
  SQLite::Database(finished.string(), SQLite::OPEN_READWRITE)
      .exec("UPDATE campaign SET status = 'success', finished_utc = '2026-03-01T12:00:30.000Z'");
  std::ofstream(scratch.path() / "began_never.db");

  const auto found = recover(scratch.path(), kNow);
  ASSERT_EQ(found.size(), 3U);
  for (const auto& one : found) {
    EXPECT_TRUE(std::filesystem::exists(one.file)) << one.file;
    EXPECT_EQ(one.damaged, one.file != newer) << one.what;
    EXPECT_THAT(one.what, HasSubstr(one.damaged ? "set aside as" : "newer shakerd"));
  }
  EXPECT_FALSE(std::filesystem::exists(damaged));
  EXPECT_FALSE(std::filesystem::exists(text));
  EXPECT_TRUE(std::filesystem::exists(newer));
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "began_never.db"));
  EXPECT_EQ(CampaignReader::open(finished)->campaign()->status, "success");
  // The second start reports the newer one only.
  EXPECT_EQ(recover(scratch.path(), kNow).size(), 1U);
}

TEST(Recovery, OfAnInterruptedCampaignCountsWhatIsThereAndMarksIt) {
  const Scratch scratch;
  const auto file = write_campaign(scratch.path());
  const auto found = recover(scratch.path(), kNow);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].campaign, "first light");
  EXPECT_EQ(found[0].documents, 200);
  EXPECT_THAT(found[0].what, HasSubstr("200 documents"));
  EXPECT_EQ(CampaignReader::open(file)->campaign()->finished_utc, kNow);
}

// A campaign that says "success" without a time of its end was cut between the two.
TEST(Recovery, OfACampaignWithoutATimeOfItsEndTreatsItAsInterrupted) {
  const Scratch scratch;
  const auto file = write_campaign(scratch.path());
  SQLite::Database(file.string(), SQLite::OPEN_READWRITE)
      .exec("UPDATE campaign SET status = 'success', finished_utc = ''");
  const auto found = recover(scratch.path(), kNow);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].documents, 200);
  EXPECT_EQ(CampaignReader::open(file)->campaign()->finished_utc, kNow);
}

// A time of the end alone ends no campaign: its status says that it was running.
TEST(Recovery, OfACampaignThatWasRunningTreatsItAsInterruptedWhateverItsEndIs) {
  const Scratch scratch;
  const auto file = write_campaign(scratch.path());
  SQLite::Database(file.string(), SQLite::OPEN_READWRITE)
      .exec("UPDATE campaign SET finished_utc = '2026-03-01T12:00:30.000Z'");
  const auto found = recover(scratch.path(), kNow);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(CampaignReader::open(file)->campaign()->status, "interrupted");
}

// Only a file without a single byte is removed.
TEST(Recovery, SetsAFileOfOneByteAside) {
  const Scratch scratch;
  const auto file = scratch.path() / "a.db";
  std::ofstream(file) << 'S';
  const auto found = recover(scratch.path(), kNow);
  ASSERT_EQ(found.size(), 1U);
  ASSERT_TRUE(std::filesystem::exists(found[0].aside)) << found[0].what;
  EXPECT_EQ(std::filesystem::file_size(found[0].aside), 1U);
}

// Such a log must be reported and kept: neither removed nor checkpointed as if it were whole.
TEST(Recovery, OfALogThatIsDamagedEarlyOrEmptyRemovesNothing) {
  for (const bool cut : {false, true}) {
    const Scratch scratch, left;
    std::filesystem::path file;
    {
      auto writer = CampaignWriter::create(scratch.path(), example_campaign());
      ASSERT_TRUE(writer) << writer.error().what;
      for (std::uint64_t i = 1; i <= 49; ++i) {
        ASSERT_TRUE(writer->add_document(i, std::string(3000, 'd')));
        ASSERT_TRUE(writer->commit());
      }
      file = left.path() / writer->file().filename();
      for (const char* part : {"", "-wal", "-shm"})
        std::filesystem::copy_file(writer->file().string() + part, file.string() + part);
    }
    const auto log = file.string() + "-wal";
    if (cut)
      std::filesystem::resize_file(log, 0);
    else
      overwrite(log, 100'000, 1);
    const auto size = std::filesystem::file_size(log);
    const auto found = recover(left.path(), kNow);
    ASSERT_EQ(found.size(), 1U) << cut;
    EXPECT_TRUE(found[0].damaged);
    EXPECT_FALSE(found[0].whole);
    EXPECT_THAT(found[0].what, ::testing::Not(HasSubstr("all whole")));
    EXPECT_THAT(found[0].what, HasSubstr("commits are lost"));
    EXPECT_GE(found[0].documents + found[0].lost_commits, 49);
    EXPECT_EQ(std::filesystem::file_size(found[0].aside.string() + "-wal"), size);
    EXPECT_TRUE(std::filesystem::exists(found[0].aside));
  }
}

// The file already contains what the damaged log held: nothing is lost.
TEST(Recovery, LosesNothingOfADamagedLogThatWasFoldedInBefore) {
  const Scratch scratch, left;
  auto writer = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(writer);
  for (std::uint64_t i = 1; i <= 49; ++i) {
    ASSERT_TRUE(writer->add_document(i, std::string(3000, 'd')));
    ASSERT_TRUE(writer->commit());
  }
  SQLite::Database other(writer->file().string(), SQLite::OPEN_READWRITE);
  other.exec("PRAGMA wal_checkpoint(PASSIVE)");
  const auto file = left.path() / writer->file().filename();
  for (const char* part : {"", "-wal", "-shm"})
    std::filesystem::copy_file(writer->file().string() + part, file.string() + part);
  overwrite(file.string() + "-wal", 100'000, 1);
  const auto found = recover(left.path(), kNow);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].documents, 49);
  EXPECT_EQ(found[0].lost_commits, 0) << found[0].what;
}

TEST(Recovery, SetsAnEmptyFileWithAJournalAsideAsUnbegun) {
  const Scratch scratch;
  const auto file = scratch.path() / "a.db";
  std::ofstream(file).flush();
  std::ofstream(file.string() + "-journal") << std::string(600, 'j');
  const auto found = recover(scratch.path(), kNow);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0].aside.string(), HasSubstr("a.db.unbegun-"));
}

// The check at the start changes nothing, however often it runs.
TEST(Recovery, LooksFirstAndChecksLater) {
  const Scratch scratch;
  const auto running = write_campaign(scratch.path());
  auto ended = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(ended->finish("success", kNow));
  EXPECT_THAT(interrupted(scratch.path()), ::testing::ElementsAre(running));
  EXPECT_THAT(interrupted(scratch.path()), ::testing::ElementsAre(running));
  EXPECT_EQ(CampaignReader::open(running)->campaign()->status, "running");
  const auto found = recover_one(running, kNow);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->documents, 200);
  EXPECT_TRUE(interrupted(scratch.path()).empty());
}

TEST(Recovery, OfAValueThatWasChangedSaysSoAndKeepsTheFile) {
  const Scratch scratch;
  const auto file = write_campaign(scratch.path());
  SQLite::Database(file.string(), SQLite::OPEN_READWRITE)
      .exec("UPDATE document SET line = 'x' WHERE seq = 77");
  const auto found = recover(scratch.path(), kNow);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0].damaged);
  EXPECT_EQ(found[0].unsound_rows, 1);
  EXPECT_EQ(found[0].documents, 199);
  EXPECT_EQ(found[0].missing_documents, 1);
  EXPECT_THAT(found[0].what, HasSubstr("1 rows do not fit their checksums"));
  EXPECT_EQ(CampaignReader::open(file)->documents()->size(), 199U);
  EXPECT_TRUE(std::filesystem::exists(found[0].aside));
}

TEST(Writer, NoticesThatAFileOfItsIsGoneOrReplaced) {
  for (const std::string part : {"", "-wal", "-shm"}) {
    for (const bool replaced : {false, true}) {
      const Scratch scratch;
      auto writer = CampaignWriter::create(scratch.path(), example_campaign());
      ASSERT_TRUE(writer) << writer.error().what;
      ASSERT_TRUE(writer->add_document(1, "{}"));
      ASSERT_TRUE(writer->commit());
      EXPECT_TRUE(writer->still_there());
      const std::string path = writer->file().string() + part;
      std::filesystem::rename(path, path + ".moved");
      if (replaced) std::filesystem::copy_file(path + ".moved", path);
      const auto there = writer->still_there();
      ASSERT_FALSE(there) << path;
      EXPECT_THAT(there.error().what, HasSubstr(path + ": was removed, moved or replaced"));
    }
  }
}

TEST(Writer, DoesNotMissTheLogOfAnEndedCampaign) {
  const Scratch scratch;
  auto writer = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(writer->finish("success", kNow));
  EXPECT_TRUE(writer->still_there());
}

TEST(Recovery, OfADirectoryThatIsNotThereFindsNothing) {
  EXPECT_TRUE(recover("/nonexistent/shakerd", kNow).empty());
}

struct Unmounted {
  const Scratch& scratch;
  ~Unmounted() { ::umount2(scratch.path().c_str(), MNT_DETACH); }
};

// A real small disk, where the test may mount one.
TEST(FullDisk, OfARealFileSystemIsASentence) {
  const Scratch scratch;
  if (::mount("tmpfs", scratch.path().c_str(), "tmpfs", 0, "size=300k") != 0) {
    GTEST_SKIP() << "needs the right to mount a tmpfs";
  }
  const Unmounted after{scratch};

  auto writer = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(writer) << writer.error().what;
  std::uint64_t kept = 0;
  Result<void> written;
  for (std::uint64_t i = 0; i < 2000 && written; ++i) {
    written = writer->add_document(i, std::string(1000, 'x'));
    if (written) written = writer->commit();
    if (written) kept = i + 1;
  }
  EXPECT_GT(kept, 0U);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::exhausted) << written.error().what;
  EXPECT_THAT(written.error().what, HasSubstr("the disk is full; free space on it"));
  EXPECT_GE(CampaignReader::open(writer->file())->documents()->size(), kept);
}

}  // namespace
}  // namespace shaker::record
