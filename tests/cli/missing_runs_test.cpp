#include "cli/missing_runs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/record/scratch.hpp"

namespace shaker::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const char* const kThreeRuns =
    R"({"name": "c", "model": {"name": "m", "effects": [{"effect": "gravity"}]}, "runs": [
        {"name": "slow", "frequency_hz": 1, "amplitude": 2, "cycles": 3},
        {"name": "middle", "frequency_hz": 2, "amplitude": 2, "cycles": 3},
        {"name": "fast", "frequency_hz": 3, "amplitude": 2, "cycles": 3}], "reference_mass": 5})";

class MissingRuns : public ::testing::Test {
 protected:
  struct Measured {
    record::RunRow run;
    int accepted = 0;
  };
  std::filesystem::path file_with(const std::vector<Measured>& measured,
                                  const std::string& spec = kThreeRuns,
                                  const std::string& rig = "rig A") {
    record::CampaignRow row = record::testing::example_campaign();
    row.spec_json = spec;
    row.rig = rig;
    auto writer = record::CampaignWriter::create(scratch_.path(), row);
    EXPECT_TRUE(writer);
    for (const Measured& one : measured) {
      EXPECT_TRUE(writer->add_run(one.run));
      for (int k = 0; k < 5; ++k)
        EXPECT_TRUE(writer->add_cycle(
            {one.run.index, k, k < one.accepted, one.run.frequency_hz, 2.0, {0.1, 0.2}, {}, 0.0}));
    }
    EXPECT_TRUE(writer->finish("abort", "2026-03-01T12:05:00.000Z"));
    return writer->file();
  }
  static std::vector<std::string> names(const config::CampaignSpec& campaign) {
    std::vector<std::string> found;
    for (const config::RunSpec& run : campaign.runs)
      found.push_back(run.name);
    return found;
  }

  record::testing::Scratch scratch_;
};

TEST_F(MissingRuns, AreThoseThatAStopCutShortAndThoseBehindIt) {
  const auto file = file_with({{{0, "slow", 1, 2, 3}, 3}, {{1, "middle", 2, 2, 3}, 2}});
  const auto campaign = missing_runs({file});
  ASSERT_TRUE(campaign) << campaign.error().what;
  EXPECT_THAT(names(campaign->campaign), ElementsAre("middle", "fast"));
  EXPECT_EQ(campaign->campaign.runs[0].cycles, 3) << "from its first cycle";
  EXPECT_EQ(campaign->campaign.resumes, file.filename());
  EXPECT_EQ(campaign->campaign.reference_mass, 5.0);
  EXPECT_EQ(campaign->rig, "rig A");
}

TEST_F(MissingRuns, AreThoseThatNoneOfSeveralFilesHolds) {
  const auto first = file_with({{{0, "slow", 1, 2, 3}, 3}, {{1, "middle", 2, 2, 3}, 2}});
  const auto second = file_with({{{0, "middle", 2, 2, 3}, 3}});
  const auto campaign = missing_runs({first, second});
  ASSERT_TRUE(campaign) << campaign.error().what;
  EXPECT_THAT(names(campaign->campaign), ElementsAre("fast"));
  EXPECT_EQ(campaign->campaign.resumes,
            first.filename().string() + ", " + second.filename().string());
  const auto third = file_with({{{0, "fast", 3, 2, 3}, 4}});
  EXPECT_TRUE(missing_runs({first, second, third})->campaign.runs.empty());
}

TEST_F(MissingRuns, IsARunOfTheSameNameAtAnotherAmplitudeToo) {
  const auto campaign = missing_runs({file_with({{{0, "slow", 1, 1.5, 3}, 3}})});
  EXPECT_THAT(names(campaign->campaign), ElementsAre("slow", "middle", "fast"));
}

TEST_F(MissingRuns, AreNotFoundInAnotherCampaignNorRigNorDamper) {
  const std::string rest = std::string(kThreeRuns).substr(std::string(R"({"name": "c")").size());
  const std::vector<Measured> all = {
      {{0, "slow", 1, 2, 3}, 3}, {{1, "middle", 2, 2, 3}, 3}, {{2, "fast", 3, 2, 3}, 3}};
  const auto first = file_with({}, R"({"name": "c", "specimen": {"serial": "N-1"})" + rest);
  EXPECT_THAT(missing_runs({first, file_with(all, R"({"name": "d")" + rest)}).error().what,
              HasSubstr(R"(holds the campaign "d", and the first database has "c")"));
  EXPECT_THAT(missing_runs({first, file_with(all, kThreeRuns, "rig B")}).error().what,
              HasSubstr(R"(was measured on the rig "rig B", and the first database has "rig A")"));
  const auto another = file_with(all, R"({"name": "c", "specimen": {"serial": "N-2"})" + rest);
  EXPECT_THAT(missing_runs({first, another}).error().what,
              HasSubstr(R"(has the serial number "N-2", and the first database has "N-1")"));
  EXPECT_TRUE(missing_runs({first, file_with(all)})) << "a number that nobody has stated";
}

TEST_F(MissingRuns, NeedADatabaseThatHoldsACampaign) {
  EXPECT_THAT(missing_runs({scratch_.path() / "none.db"}).error().what,
              HasSubstr("there is no such file"));
  auto writer =
      record::CampaignWriter::create(scratch_.path(), record::testing::example_campaign());
  ASSERT_TRUE(writer->finish("success", "2026-03-01T12:05:00.000Z"));
  EXPECT_THAT(missing_runs({writer->file()}).error().what, HasSubstr("(its campaign)"));
}

}  // namespace
}  // namespace shaker::cli
