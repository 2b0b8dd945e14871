#include "gateway/downloads.hpp"

#include <fstream>
#include <stdlib.h>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <unistd.h>

namespace shaker::gateway {
namespace {

namespace fs = std::filesystem;

class DownloadsTest : public ::testing::Test {
 protected:
  DownloadsTest() {
    std::string pattern = (fs::temp_directory_path() / "downloads.XXXXXX").string();
    root = ::mkdtemp(pattern.data());
    directory = root / "data";
    fs::create_directories(directory / "first.diagnosis");
    write(root / "secret.db", "secret");
    write(directory / "first.db", "campaign");
    write(directory / "first.diagnosis" / "report.html", "<p>report");
    write(directory / "running.db", "half");
    write(directory / "running.db-wal", "rest");
    write(directory / "first.db-wal", "");  // a reader left it behind
    write(directory / "notes.txt", "notes");
    fs::create_symlink(root / "secret.db", directory / "link.db");
    fs::create_directories(directory / "folder.db");
  }
  ~DownloadsTest() override { fs::remove_all(root); }
  static void write(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }
  static std::string content(const std::optional<Download>& file) {
    if (!file) return "(none)";
    std::string text(file->bytes, '\0');
    EXPECT_EQ(::read(file->fd.get(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
    return text;
  }
  fs::path root, directory;
};

TEST_F(DownloadsTest, AreTheWholeCampaignsAndTheirReports) {
  const Downloads downloads(directory);
  EXPECT_EQ(content(downloads.campaign("first.db")), "campaign");
  EXPECT_EQ(content(downloads.report("first.html")), "<p>report");
  EXPECT_FALSE(downloads.campaign("running.db"));
  const auto list = downloads.list()["campaigns"];
  ASSERT_EQ(list.size(), 2U);
  for (const auto& one : list) {
    EXPECT_EQ(one["recording"], one["name"] == "running");
    EXPECT_EQ(one["report"], one["name"] == "first");
  }
}

// The writer empties its log before it changes the header of the file.
TEST_F(DownloadsTest, GiveNoCampaignWhoseWriterIsNotDoneWithIt) {
  const fs::path file = directory / "folding.db";
  const Downloads downloads(directory);
  {
    SQLite::Database database(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    database.exec("PRAGMA journal_mode=WAL; CREATE TABLE run (idx); INSERT INTO run VALUES (1)");
    EXPECT_FALSE(downloads.campaign("folding.db"));
    database.exec("PRAGMA wal_checkpoint(TRUNCATE)");
    ASSERT_EQ(fs::file_size(file.string() + "-wal"), 0U);
    EXPECT_FALSE(downloads.campaign("folding.db"));
    database.exec("PRAGMA journal_mode=DELETE");
    EXPECT_TRUE(downloads.campaign("folding.db"));
    database.exec("PRAGMA journal_mode=WAL");
  }
  EXPECT_TRUE(downloads.campaign("folding.db"))
      << "a file that no program has open changes no more";
}

TEST_F(DownloadsTest, LeadNowhereElse) {
  const Downloads downloads(directory);
  for (const char* name : {"", "../secret.db", "..", "/etc/passwd", "link.db", "folder.db",
                           "notes.txt", "first", "./first.db", "first.db/", "first.db\n"})
    EXPECT_FALSE(downloads.campaign(name)) << name;
  for (const char* name : {"", "../secret.html", "running.html", "first.db", "first"})
    EXPECT_FALSE(downloads.report(name)) << name;
}

TEST_F(DownloadsTest, AreNoneWithoutADirectory) {
  EXPECT_TRUE(Downloads({}).list()["campaigns"].empty());
  EXPECT_FALSE(Downloads({}).campaign("first.db"));
  EXPECT_TRUE(Downloads(root / "not there").list()["campaigns"].empty());
}

}  // namespace
}  // namespace shaker::gateway
