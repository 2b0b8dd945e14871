#include "record/campaign_files.hpp"

#include <fstream>

#include "record/accepted_cycles.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::record {
namespace {

using ::testing::HasSubstr;

class CampaignFiles : public ::testing::Test {
 protected:
  void make(const std::string& name) { std::ofstream(directory.path() / name) << "x"; }
  std::string found(const std::string& name) {
    const auto file = find_campaign(directory.path(), name);
    return file ? file->filename().string() : file.error().what;
  }
  testing::Scratch directory;
};

TEST_F(CampaignFiles, AreFoundByFileByCampaignAndByAge) {
  make("A_run__3_Hz_20260301T120000Z.db");
  make("A_run__3_Hz_20260302T120000Z.db");
  make("A_run__3_Hz_20260302T120000Z.db-wal");
  make("other_20260303T120000Z.db");
  make("other_20260302T120000Z_2.db");
  make("copied.db");
  EXPECT_EQ(found("A run, 3 Hz"), "A_run__3_Hz_20260302T120000Z.db");
  EXPECT_EQ(found("A_run__3_Hz_20260301T120000Z.db"), "A_run__3_Hz_20260301T120000Z.db");
  EXPECT_EQ(found("other_20260302T120000Z_2"), "other_20260302T120000Z_2.db");
  EXPECT_EQ(found("other"), "other_20260303T120000Z.db");
  EXPECT_EQ(found("copied"), "copied.db");
  EXPECT_EQ(found(""), "other_20260303T120000Z.db");
  EXPECT_THAT(found("another"), HasSubstr("no campaign \"another\" among the 5"));
}

TEST_F(CampaignFiles, ThatAreNotThereAreSaidToBe) {
  EXPECT_THAT(found(""), HasSubstr("no campaign yet"));
  EXPECT_THAT(found("../x"), HasSubstr("no campaign yet"));
}

TEST_F(CampaignFiles, TheSecondOfOneSecondIsTheNewer) {
  make("c_20260301T120000Z.db");
  make("c_20260301T120000Z_2.db");
  std::filesystem::last_write_time(
      directory.path() / "c_20260301T120000Z.db",
      std::filesystem::file_time_type::clock::now() - std::chrono::minutes(1));
  EXPECT_EQ(found("c"), "c_20260301T120000Z_2.db");
}

CycleRow cycle(int run, int index, bool accepted, double frequency, double shift) {
  CycleRow row;
  row.run = run;
  row.index = index;
  row.accepted = accepted;
  row.frequency_hz = frequency;
  row.amplitude = 3.0;
  row.displacement = {shift, shift + 1, shift + 2, shift + 3};
  return row;
}

TEST_F(CampaignFiles, AcceptedCyclesFollowOneAnotherInTime) {
  CampaignRow campaign;
  campaign.name = "c";
  campaign.started_utc = "2026-03-01T12:00:00.000Z";
  auto writer = CampaignWriter::create(directory.path(), campaign);
  ASSERT_TRUE(writer) << writer.error().what;
  ASSERT_TRUE(writer->add_run({0, "slow", 2.0, 3.0, 2}));
  ASSERT_TRUE(writer->add_run({1, "empty", 2.0, 3.0, 2}));
  ASSERT_TRUE(writer->add_cycle(cycle(0, 0, true, 1.9, 10.0)));
  ASSERT_TRUE(writer->add_cycle(cycle(0, 1, false, 5.0, 20.0)));
  ASSERT_TRUE(writer->add_cycle(cycle(0, 2, true, 2.1, 30.0)));
  ASSERT_TRUE(writer->add_cycle(cycle(1, 3, false, 2.0, 40.0)));
  ASSERT_TRUE(writer->finish("success", "2026-03-01T12:01:00.000Z"));
  const auto reader = CampaignReader::open(writer->file());
  ASSERT_TRUE(reader) << reader.error().what;
  const auto runs = accepted_cycles(*reader);
  ASSERT_TRUE(runs) << runs.error().what;
  ASSERT_EQ(runs->size(), 2U);
  const AcceptedCycles& slow = (*runs)[0];
  EXPECT_EQ(slow.name, "slow");
  EXPECT_DOUBLE_EQ(slow.frequency_hz, 2.0);
  EXPECT_DOUBLE_EQ(slow.amplitude, 3.0);
  EXPECT_THAT(slow.displacement, ::testing::ElementsAre(10, 11, 12, 13, 30, 31, 32, 33));
  ASSERT_EQ(slow.t.size(), 8U);
  EXPECT_DOUBLE_EQ(slow.t[3], 3.0 / 8.0);
  EXPECT_DOUBLE_EQ(slow.t[4], 0.5);
  EXPECT_NEAR(slow.excitation[6], -3.0, 1e-12);  // half a turn later
  EXPECT_EQ((*runs)[1].name, "empty");
  EXPECT_TRUE((*runs)[1].t.empty());
}

}  // namespace
}  // namespace shaker::record
