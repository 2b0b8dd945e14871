#include "record/provenance.hpp"

#include <SQLiteCpp/SQLiteCpp.h>

#include "record/recovery.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::record {
namespace {

using testing::example_campaign;
using ::testing::HasSubstr;
using testing::Scratch;

std::filesystem::path finished_with(const Scratch& scratch, const std::vector<Fact>& facts) {
  auto writer = CampaignWriter::create(scratch.path(), example_campaign(), facts);
  EXPECT_TRUE(writer);
  EXPECT_TRUE(
      writer->add_fact({"person", "ended because", "stopped by anna"}, "2026-03-01T12:04Z"));
  EXPECT_TRUE(writer->finish("abort", "2026-03-01T12:05:00.000Z"));
  return writer->file();
}

// The values of FIPS 180-4's examples.
TEST(Provenance, HashesAsTheStandardDoes) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

TEST(Provenance, ComesBackInOrderWithItsHashes) {
  const Scratch scratch;
  const auto file =
      finished_with(scratch, {{"rig file", "/etc/rig.json", "{\n}\n"}, {"host", "name", "süd"}});
  const auto facts = CampaignReader::open(file)->facts();
  ASSERT_TRUE(facts) << facts.error().what;
  ASSERT_EQ(facts->size(), 3U);
  EXPECT_EQ((*facts)[0].value, "{\n}\n");
  EXPECT_EQ((*facts)[0].sha256, "d914176fd50bd7f565700006a31aa97b79d3ad17cee20c8e5ff2061d5cb74817");
  EXPECT_EQ((*facts)[0].utc, example_campaign().started_utc);
  EXPECT_EQ((*facts)[1].value, "süd");
  EXPECT_EQ((*facts)[2].value, "stopped by anna");
  EXPECT_EQ((*facts)[2].utc, "2026-03-01T12:04Z");
  for (const Fact& fact : *facts)
    EXPECT_TRUE(holds(fact)) << fact.name;
}

TEST(Provenance, ShowsAValueThatWasChanged) {
  const Scratch scratch;
  const auto file = finished_with(scratch, {{"specimen", "serial", "N-042"}});
  SQLite::Database(file.string(), SQLite::OPEN_READWRITE)
      .exec("UPDATE fact SET value = 'N-043' WHERE name = 'serial'");
  const auto facts = CampaignReader::open(file)->facts();
  ASSERT_TRUE(facts);
  EXPECT_FALSE(holds(facts->front()));
  EXPECT_TRUE(holds(facts->back()));
}

TEST(Provenance, TakesNotesIntoAFinishedCampaign) {
  const Scratch scratch;
  const auto file = finished_with(scratch, {});
  ASSERT_TRUE(add_note(file, {"note", "anna", "the oil was cold", "2026-03-02T08:00:00.000Z"}));
  ASSERT_TRUE(add_note(file, {"note", "otto", "no, it was not", "2026-03-02T09:00:00.000Z"}));
  const auto facts = CampaignReader::open(file)->facts();
  ASSERT_EQ(facts->size(), 3U);
  EXPECT_EQ((*facts)[1].value, "the oil was cold");
  EXPECT_EQ((*facts)[2].name, "otto");
  EXPECT_EQ((*facts)[2].utc, "2026-03-02T09:00:00.000Z");
  EXPECT_TRUE(holds((*facts)[2]));
}

// Layout 3 had the checksums and no facts.
TEST(Provenance, OfALayoutWithoutItIsReadAndTakesNotes) {
  const Scratch scratch;
  const auto file = finished_with(scratch, {});
  SQLite::Database(file.string(), SQLite::OPEN_READWRITE)
      .exec("DROP TABLE fact; PRAGMA user_version=3");
  EXPECT_TRUE(CampaignReader::open(file)->facts()->empty());
  SQLite::Database(file.string(), SQLite::OPEN_READWRITE)
      .exec("UPDATE campaign SET status = 'running', finished_utc = ''");
  const auto found = recover(scratch.path(), "2026-03-02T07:00:00.000Z");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_FALSE(found.front().damaged) << found.front().what;
  ASSERT_TRUE(add_note(file, {"note", "anna", "found again", "2026-03-02T08:00:00.000Z"}));
  const auto facts = CampaignReader::open(file)->facts();
  ASSERT_EQ(facts->size(), 1U);
  EXPECT_EQ(facts->front().value, "found again");
}

TEST(Provenance, RefusesANoteWhileTheCampaignIsBeingRecorded) {
  const Scratch scratch;
  auto writer = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(writer);
  const auto refused = add_note(writer->file(), {"note", "anna", "too early", ""});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("still being recorded; add the note when it has"));
  EXPECT_TRUE(writer->add_document(1, "{}"));
  EXPECT_TRUE(writer->commit());
}

}  // namespace
}  // namespace shaker::record
