#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>

#include <SQLiteCpp/SQLiteCpp.h>

#include "record/campaign_database.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::record {
namespace {

using testing::example_campaign;
using testing::example_sample;
using testing::Scratch;

std::vector<SampleRow> samples(int from, int count) {
  std::vector<SampleRow> rows;
  for (int i = from; i < from + count; ++i)
    rows.push_back(example_sample(i));
  return rows;
}

void expect_same(const std::vector<SampleRow>& read, const std::vector<SampleRow>& written) {
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].t_ns, written[i].t_ns);
    EXPECT_EQ(read[i].value, written[i].value);
    EXPECT_EQ(read[i].channel, written[i].channel);
    EXPECT_EQ(read[i].quality, written[i].quality);
  }
}

TEST(Campaign, ComesBackAsItWasWritten) {
  const Scratch scratch;
  auto writer = CampaignWriter::create(scratch.path() / "made" / "for it", example_campaign());
  ASSERT_TRUE(writer) << writer.error().what;
  EXPECT_EQ(writer->file().filename(), "first_light_20260301T120000Z.db");

  const RunRow first{0, "r01", 2.5, 3.25, 20}, second{1, "süd/2", 4.125, 1e-3, 7};
  ASSERT_TRUE(writer->add_run(first));
  // More than one block, added in pieces of odd size; the run changes inside a block.
  ASSERT_TRUE(writer->add_samples(-1, samples(0, 3)));
  ASSERT_TRUE(writer->add_samples(0, samples(3, 5000)));
  ASSERT_TRUE(writer->add_samples(0, samples(5003, 1)));
  ASSERT_TRUE(writer->add_run(second));
  ASSERT_TRUE(writer->add_samples(1, samples(6000, 10)));
  const CycleRow cycle{1, 42, true, 4.1251, 0.99e-3, {0.1, -0.2, 1.0 / 3.0}, {}, 2.5e-4};
  ASSERT_TRUE(writer->add_cycle(cycle));
  ASSERT_TRUE(writer->add_document(7, R"({"seq":7,"text":"größer"})"));
  ASSERT_TRUE(writer->add_document(8, R"({"seq":8})"));
  ASSERT_TRUE(writer->commit());
  ASSERT_TRUE(writer->finish("success", "2026-03-01T12:05:00.000Z"));

  const auto reader = CampaignReader::open(writer->file());
  ASSERT_TRUE(reader) << reader.error().what;
  const auto row = reader->campaign();
  ASSERT_TRUE(row);
  EXPECT_EQ(row->name, "first light");
  EXPECT_EQ(row->started_utc, "2026-03-01T12:00:00.123Z");
  EXPECT_EQ(row->rig, "rig A");
  ASSERT_EQ(row->auxiliary.size(), 1u);
  EXPECT_EQ(row->auxiliary.at(protocol::Channel::aux2).name, "oil_temperature");
  EXPECT_EQ(row->auxiliary.at(protocol::Channel::aux2).unit, "degC");
  EXPECT_EQ(row->spec_json, R"({"runs": []})");
  EXPECT_EQ(row->model_json, R"({"name": "oleo"})");
  EXPECT_EQ(row->status, "success");
  EXPECT_EQ(row->finished_utc, "2026-03-01T12:05:00.000Z");

  const auto runs = reader->runs();
  ASSERT_TRUE(runs);
  ASSERT_EQ(runs->size(), 2U);
  EXPECT_EQ((*runs)[1].name, "süd/2");
  EXPECT_EQ((*runs)[1].frequency_hz, 4.125);
  EXPECT_EQ((*runs)[1].amplitude, 1e-3);
  EXPECT_EQ((*runs)[1].cycles_wanted, 7);

  expect_same(*reader->samples(-1), samples(0, 3));
  expect_same(*reader->samples(0), samples(3, 5001));
  expect_same(*reader->samples(1), samples(6000, 10));

  const auto cycles = reader->cycles(1);
  ASSERT_TRUE(cycles);
  ASSERT_EQ(cycles->size(), 1U);
  EXPECT_EQ(cycles->front().index, 42);
  EXPECT_TRUE(cycles->front().accepted);
  EXPECT_EQ(cycles->front().displacement, cycle.displacement);
  EXPECT_TRUE(cycles->front().excitation.empty());
  EXPECT_EQ(cycles->front().excitation_error, 2.5e-4);
  EXPECT_THAT(*reader->documents(),
              ::testing::ElementsAre(R"({"seq":7,"text":"größer"})", R"({"seq":8})"));
}

// Samples become a row exactly when a block is full. Whatever the sizes of the pieces, the file
// has whole blocks and nothing is left for the commit.
TEST(Campaign, CutsSamplesIntoBlocksOf4096) {
  struct Case {
    std::vector<int> pieces;
    std::vector<int> rows;
  };
  for (const auto& [pieces, rows] : std::vector<Case>{{{4095}, {4095}},
                                                      {{4096}, {4096}},
                                                      {{4097}, {4096, 1}},
                                                      {{4095, 1}, {4096}},
                                                      {{4095, 2}, {4096, 1}},
                                                      {{1, 4096}, {4096, 1}},
                                                      {{3000, 3000, 2192}, {4096, 4096}},
                                                      {{8192}, {4096, 4096}},
                                                      {{9000}, {4096, 4096, 808}}}) {
    const Scratch scratch;
    auto writer = CampaignWriter::create(scratch.path(), example_campaign());
    ASSERT_TRUE(writer) << writer.error().what;
    int from = 0;
    for (const int piece : pieces) {
      ASSERT_TRUE(writer->add_samples(0, samples(from, piece)));
      from += piece;
    }
    ASSERT_TRUE(writer->commit());
    SQLite::Database database(writer->file().string(), SQLite::OPEN_READONLY);
    SQLite::Statement row(database, "SELECT count, length(data) FROM sample ORDER BY id");
    std::vector<int> kept;
    while (row.executeStep()) {
      kept.push_back(row.getColumn(0).getInt());
      EXPECT_EQ(row.getColumn(1).getInt(), 18 * kept.back());
    }
    EXPECT_EQ(kept, rows) << from;
    const auto reader = CampaignReader::open(writer->file());
    ASSERT_TRUE(reader);
    expect_same(*reader->samples(0), samples(0, from));
  }
}

TEST(Campaign, CommitsWithNothingAddedAndTwice) {
  const Scratch scratch;
  auto writer = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(writer);
  EXPECT_TRUE(writer->commit());
  ASSERT_TRUE(writer->add_samples(0, samples(0, 5)));
  ASSERT_TRUE(writer->add_samples(0, {}));
  ASSERT_TRUE(writer->commit());
  ASSERT_TRUE(writer->commit());
  const auto reader = CampaignReader::open(writer->file());
  ASSERT_TRUE(reader);
  expect_same(*reader->samples(0), samples(0, 5));
}

TEST(Campaign, KeepsSamplesThatAreNotNumbers) {
  const Scratch scratch;
  auto writer = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(writer);
  const SampleRow nan{1, std::numeric_limits<double>::quiet_NaN(), {}, 2};
  const SampleRow infinite{2, -std::numeric_limits<double>::infinity(), {}, 2};
  ASSERT_TRUE(writer->add_samples(0, std::vector{nan, infinite}));
  ASSERT_TRUE(writer->commit());
  const auto reader = CampaignReader::open(writer->file());
  ASSERT_TRUE(reader);
  const auto read = reader->samples(0);
  ASSERT_TRUE(read);
  ASSERT_EQ(read->size(), 2U);
  EXPECT_TRUE(std::isnan((*read)[0].value));
  EXPECT_EQ((*read)[1].value, -std::numeric_limits<double>::infinity());
}

TEST(Campaign, CanBeReadWhileItIsWrittenAndShowsOnlyWhatIsCommitted) {
  const Scratch scratch;
  auto writer = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(writer);
  const auto reader = CampaignReader::open(writer->file());
  ASSERT_TRUE(reader) << reader.error().what;
  ASSERT_TRUE(writer->add_document(1, "{}"));
  EXPECT_EQ(reader->documents()->size(), 0U);
  ASSERT_TRUE(writer->commit());
  EXPECT_EQ(reader->documents()->size(), 1U);
  EXPECT_EQ(reader->campaign()->status, "running");
}

// `shakerctl show` right after the end must not look like a disk that does not answer.
TEST(Campaign, EndsWithoutWaitingForAReader) {
  const Scratch scratch;
  auto writer = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->add_document(1, "{}"));
  ASSERT_TRUE(writer->commit());
  SQLite::Database reader(writer->file().string(), SQLite::OPEN_READONLY);
  SQLite::Statement row(reader, "SELECT line FROM document");
  ASSERT_TRUE(row.executeStep());  // holds its view of the file
  const auto before = std::chrono::steady_clock::now();
  ASSERT_TRUE(writer->finish("success", "2026-03-01T12:05:00.000Z"));
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::milliseconds(800));
  row.reset();
  EXPECT_EQ(CampaignReader::open(writer->file())->campaign()->status, "success");
}

TEST(Campaign, TwoWritersOfOneNameAndSecondGetAFileEach) {
  const Scratch scratch;
  auto one = CampaignWriter::create(scratch.path(), example_campaign());
  auto two = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(one);
  ASSERT_TRUE(two);
  EXPECT_NE(one->file(), two->file());
  for (std::uint64_t i = 0; i < 50; ++i) {
    ASSERT_TRUE(one->add_document(i, "one"));
    ASSERT_TRUE(two->add_document(i, "two"));
    ASSERT_TRUE(one->commit());
    ASSERT_TRUE(two->commit());
  }
  EXPECT_THAT(*CampaignReader::open(one->file())->documents(),
              ::testing::AllOf(::testing::SizeIs(50), ::testing::Each("one")));
  EXPECT_THAT(*CampaignReader::open(two->file())->documents(),
              ::testing::AllOf(::testing::SizeIs(50), ::testing::Each("two")));
}

TEST(Campaign, FinishedIsOneFileThatCanBeCopied) {
  const Scratch scratch;
  auto writer = CampaignWriter::create(scratch.path(), example_campaign());
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->add_document(1, "{}"));
  ASSERT_TRUE(writer->finish("success", "2026-03-01T12:05:00.000Z"));
  EXPECT_FALSE(std::filesystem::exists(writer->file().string() + "-wal"));
  const auto copy = scratch.path() / "copy.db";
  std::filesystem::copy_file(writer->file(), copy);
  EXPECT_EQ(CampaignReader::open(copy)->documents()->size(), 1U);
}

TEST(Campaign, ThatCannotBeCreatedNamesFileAndRemedy) {
  const Scratch scratch;
  const auto blocked = scratch.path() / "not a directory";
  std::ofstream(blocked) << "x";
  const auto writer = CampaignWriter::create(blocked, example_campaign());
  ASSERT_FALSE(writer);
  EXPECT_THAT(writer.error().what, ::testing::HasSubstr(blocked.string()));
  EXPECT_THAT(writer.error().what, ::testing::HasSubstr("check that the data directory"));
}

}  // namespace
}  // namespace shaker::record
