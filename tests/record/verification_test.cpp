// Bytes of a campaign's file that somebody changed: each is found, or no content depends on it.
#include "record/verification.hpp"

#include <cmath>
#include <fstream>
#include <iterator>
#include <random>

#include <SQLiteCpp/SQLiteCpp.h>

#include "record/checksums.hpp"
#include "record/provenance.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::record {
namespace {

using ::testing::ElementsAre;
using testing::example_campaign;
using testing::example_sample;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Scratch;

constexpr const char* kEndOfTampered = "2026-03-01T12:05:00.000Z";

// A finished campaign of about 300 kB, with everything that a campaign can hold.
std::filesystem::path finished_campaign(const std::filesystem::path& directory) {
  auto writer = CampaignWriter::create(directory, example_campaign());
  std::uint64_t seq = 1;
  for (int run = 0; run < 3; ++run) {
    EXPECT_TRUE(writer->add_run({run, "r0" + std::to_string(run), 2.0 + run, 3.5, 8}));
    std::vector<SampleRow> samples;
    for (int i = 0; i < 3000; ++i)
      samples.push_back(example_sample(10'000 * run + i));
    EXPECT_TRUE(writer->add_samples(run, samples));
    for (int k = 0; k < 8; ++k) {
      std::vector<double> wave;
      for (int i = 0; i < 64; ++i)
        wave.push_back(std::sin(0.1 * i + k));
      EXPECT_TRUE(writer->add_cycle({run, k, k < 7, 2.0, 3.5, wave, wave, 1e-3}));
      EXPECT_TRUE(writer->add_document(seq, std::string(200 + 13 * seq, 'd')));
      ++seq;
      EXPECT_TRUE(writer->commit());
    }
  }
  EXPECT_TRUE(writer->finish("success", kEndOfTampered));
  return writer->file();
}

std::string bytes_in(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_bytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

// Every value of every row but the campaign's end, which has no checksum.
std::string content_of(const std::filesystem::path& file) {
  std::string content;
  SQLite::Database database(file.string(), SQLite::OPEN_READONLY);
  for (const char* rows : {"SELECT name, started_utc, rig, spec_json, model_json FROM campaign",
                           "SELECT * FROM run", "SELECT * FROM sample", "SELECT * FROM channel",
                           "SELECT * FROM cycle ORDER BY run, idx", "SELECT * FROM document"}) {
    SQLite::Statement each(database, rows);
    while (each.executeStep()) {
      for (int c = 0; c < each.getColumnCount(); ++c)
        content += each.getColumn(c).getString() + '\x1f';
    }
  }
  return content;
}

TEST(Verification, CountsASoundCampaign) {
  const Scratch scratch(Scratch::in_memory);
  const auto found = verify_campaign(finished_campaign(scratch.path()));
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_THAT(found->troubles, IsEmpty());
  EXPECT_FALSE(found->running);
  EXPECT_TRUE(found->summed);
  EXPECT_EQ(found->runs, 3);
  EXPECT_EQ(found->samples, 9000);
  EXPECT_EQ(found->cycles, 24);
  EXPECT_EQ(found->documents, 24);
}

// The layout before the newest one has no facts, until a note is added.
TEST(Verification, OfAnOlderLayoutHoldsAfterANoteAndNotAfterAnotherFact) {
  const Scratch scratch(Scratch::in_memory);
  const auto file = finished_campaign(scratch.path());
  const auto exec = [&](const char* sql) {
    SQLite::Database(file.string(), SQLite::OPEN_READWRITE).exec(sql);
  };
  exec("DROP TABLE fact; PRAGMA user_version = 3");
  ASSERT_TRUE(add_note(file, {.kind = "note", .name = "anna", .value = "the first of today"}));
  const auto noted = verify_campaign(file);
  ASSERT_TRUE(noted) << noted.error().what;
  EXPECT_THAT(noted->troubles, IsEmpty());
  exec("UPDATE fact SET kind = 'person'");
  EXPECT_THAT(verify_campaign(file)->troubles,
              ElementsAre("its tables are not those of its layout's version",
                          "1 row does not match its checksum"));
}

TEST(Verification, FindsEveryTamperedByteOnWhichContentDepends) {
  const Scratch scratch(Scratch::in_memory);
  const auto file = finished_campaign(scratch.path());
  const std::string bytes = bytes_in(file), content = content_of(file);
  std::mt19937_64 random(1154);
  std::uniform_int_distribution<std::size_t> where(0, bytes.size() - 1);
  std::uniform_int_distribution<int> change(1, 255);
  int found = 0;
  for (int i = 0; i < 1000; ++i) {
    std::string tampered = bytes;
    const std::size_t at = where(random);
    tampered[at] = static_cast<char>(tampered[at] ^ change(random));
    write_bytes(file, tampered);
    const auto verified = verify_campaign(file);
    if (!verified || !verified->troubles.empty())
      ++found;
    else
      EXPECT_EQ(content_of(file), content) << "byte " << at;
  }
  RecordProperty("found", found);
  EXPECT_GT(found, 700) << "of 1000; the others hold nothing";
}

TEST(Verification, FindsWhatIsGone) {
  const Scratch scratch(Scratch::in_memory);
  const auto file = finished_campaign(scratch.path());
  const std::string bytes = bytes_in(file);
  const auto after = [&](const char* sql) {
    write_bytes(file, bytes);
    SQLite::Database(file.string(), SQLite::OPEN_READWRITE).exec(sql);
    const auto verified = verify_campaign(file);
    EXPECT_TRUE(verified);
    return verified->troubles;
  };
  EXPECT_THAT(after("DELETE FROM sample WHERE id = 2"),
              ElementsAre("blocks of samples are missing"));
  EXPECT_THAT(after("DELETE FROM run WHERE idx = 0"),
              ElementsAre("runs are missing", "cycles belong to no run"));
  EXPECT_THAT(after("DELETE FROM document WHERE seq = 5"), ElementsAre("documents are missing"));
  EXPECT_THAT(after("UPDATE cycle SET amplitude = 3.6 WHERE run = 1 AND idx = 2"),
              ElementsAre("1 row does not match its checksum"));
  EXPECT_THAT(after("PRAGMA user_version = 2"),
              ElementsAre("its tables are not those of its layout's version"));
  EXPECT_THAT(after("UPDATE campaign SET finished_utc = '2026-02-01T12:05:00.000Z'"),
              ElementsAre("it does not end after it began"));
  write_bytes(file, bytes.substr(0, bytes.size() - 4096));
  const auto cut = verify_campaign(file);
  EXPECT_TRUE(!cut || !cut->troubles.empty());
}

// Campaigns of earlier versions are judged by it: Python's zlib.crc32 of each value's type (1:
// integer, 3: text) and of the integer, or of the text's length and its bytes. Numbers are words of
// 8 bytes, low byte first.
TEST(Verification, GoesByTheSumThatEarlierCampaignsHave) {
  SQLite::Database database(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  add_row_sum(database);
  const auto sum = [&](const char* values) {
    return database.execAndGet("SELECT row_sum(" + std::string(values) + ")").getInt64();
  };
  EXPECT_EQ(sum("7, 'ab'"), 2350453239);
  EXPECT_NE(sum("'ab'"), sum("x'6162'")) << "the same bytes as a text and as a blob";
  EXPECT_NE(sum("''"), sum("x''"));
  EXPECT_NE(sum("0"), sum("0.0"));
}

TEST(Verification, SaysWhatIsNotACampaign) {
  const Scratch scratch(Scratch::in_memory);
  const auto file = scratch.path() / "text.db";
  write_bytes(file, "no database");
  const auto found = verify_campaign(file);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().what, HasSubstr("is not a campaign database"));
}

}  // namespace
}  // namespace shaker::record
