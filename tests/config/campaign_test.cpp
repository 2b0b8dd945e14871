#include "config/campaign.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::config {
namespace {

const std::filesystem::path kCampaignExamples =
    std::filesystem::path(SHAKER_SOURCE_DIR) / "config" / "examples";

TEST(Campaign, TakesItsModelFromAFileBesideIt) {
  const auto campaign = load_campaign(kCampaignExamples / "campaign-three-runs.json");
  ASSERT_TRUE(campaign) << campaign.error().what;
  EXPECT_EQ(campaign->model.name, "oleo");
  ASSERT_EQ(campaign->runs.size(), 3u);
  EXPECT_EQ(campaign->runs[0].name, "slow");
}

TEST(Campaign, TakesItsModelInlineAndNamesItsRuns) {
  const auto campaign = parse_campaign(
      R"({"name": "c", "model": {"name": "m", "effects": [{"effect": "gravity"}]},
          "runs": [{"frequency_hz": 2, "amplitude": 3},
                   {"frequency_hz": 3, "amplitude": 2.5, "cycles": 7}]})",
      "c.json", ".");
  ASSERT_TRUE(campaign) << campaign.error().what;
  EXPECT_EQ(campaign->model.name, "m");
  EXPECT_EQ(campaign->runs[0].name, "r01");
  EXPECT_EQ(campaign->runs[0].cycles, 20);
  EXPECT_EQ(campaign->runs[1].name, "r02");
  EXPECT_EQ(campaign->runs[1].cycles, 7);
  EXPECT_DOUBLE_EQ(campaign->runs[1].amplitude, 2.5);
}

CampaignSpec with_runs(const std::string& runs) {
  const auto campaign = parse_campaign(
      R"({"name": "c", "model": {"name": "m", "effects": [{"effect": "gravity"}]}, "runs": [)" +
          runs + "]}",
      "c.json", ".");
  EXPECT_TRUE(campaign) << campaign.error().what;
  return campaign ? *campaign : CampaignSpec{};
}

TEST(Campaign, MakesARunOfEachStepOfASweep) {
  const auto campaign = with_runs(
      R"({"name": "up", "frequency_hz": {"from": 1, "to": 3, "steps": 5}, "amplitude": 2.5, "cycles": 8},
         {"frequency_hz": 2, "amplitude": {"from": 4, "to": 1, "steps": 3, "spacing": "logarithmic"}},
         {"frequency_hz": 2, "amplitude": 3})");
  std::vector<std::string> names;
  for (const RunSpec& run : campaign.runs)
    names.push_back(run.name);
  EXPECT_THAT(names, testing::ElementsAre("up_01", "up_02", "up_03", "up_04", "up_05", "r02_01",
                                          "r02_02", "r02_03", "r03"));
  EXPECT_DOUBLE_EQ(campaign.runs[1].frequency_hz, 1.5);
  EXPECT_DOUBLE_EQ(campaign.runs[4].frequency_hz, 3.0);
  EXPECT_EQ(campaign.runs[4].amplitude, 2.5);
  EXPECT_EQ(campaign.runs[4].cycles, 8);
  EXPECT_DOUBLE_EQ(campaign.runs[6].amplitude, 2.0);
  EXPECT_DOUBLE_EQ(campaign.runs[7].amplitude, 1.0);
  const auto again = parse_campaign(to_json_text(campaign), "again", ".");
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->runs.size(), 9u);
  EXPECT_EQ(again->runs[6].name, "r02_02");
}

TEST(Campaign, SurvivesBeingWrittenAndReadAgain) {
  const auto campaign = parse_campaign(
      R"({"name": "c", "model": {"name": "m", "effects": [{"effect": "gravity"}]},
          "runs": [{"name": "x", "frequency_hz": 2.25, "amplitude": 3, "cycles": 7}],
          "specimen": {"serial": "N-042", "charge": "18 bar"}, "resumes": "c_1.db",
          "reference_mass": 512.5, "points_per_cycle": 32, "settle_cycles_max": 9, "settle_tolerance": 2.5, "ramp_s": 1.5})",
      "c.json", ".");
  ASSERT_TRUE(campaign) << campaign.error().what;
  const auto again = parse_campaign(to_json_text(*campaign), "again", ".");
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->name, "c");
  EXPECT_EQ(again->model.effects.at(0).effect, "gravity");
  EXPECT_EQ(again->runs.at(0).name, "x");
  EXPECT_EQ(again->runs.at(0).frequency_hz, 2.25);
  EXPECT_EQ(again->runs.at(0).amplitude, 3.0);
  EXPECT_EQ(again->runs.at(0).cycles, 7);
  EXPECT_EQ(again->points_per_cycle, 32);
  EXPECT_EQ(again->reference_mass, 512.5);
  EXPECT_EQ(again->resumes, "c_1.db");
  EXPECT_EQ(entries(again->specimen), entries(campaign->specimen));
  EXPECT_EQ(entries(again->specimen).size(), 2u);
  EXPECT_EQ(reference_mass(to_json_text(*campaign)), 512.5);
  EXPECT_EQ(again->settle_cycles_max, 9);
  EXPECT_EQ(again->settle_tolerance, 2.5);
  EXPECT_EQ(again->ramp_s, 1.5);
}

TEST(Campaign, KeepsGroupAndConditionsOfARun) {
  const auto campaign = with_runs(
      R"({"name": "x", "frequency_hz": 2, "amplitude": 3, "group": "warm",
          "conditions": {"gas_temperature": "35 degC", "charge": 1.02}},
         {"name": "y", "frequency_hz": 2, "amplitude": 3})");
  const std::string text = to_json_text(campaign);
  const auto again = parse_campaign(text, "again", ".");
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->runs.at(0).condition.group, "warm");
  EXPECT_NEAR(again->runs.at(0).condition.values.at("gas_temperature"), 308.15, 1e-9);
  EXPECT_EQ(again->runs.at(0).condition.values.at("charge"), 1.02);
  const auto found = run_conditions(text);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].run, "x");
  EXPECT_EQ(found[0].values.size(), 2u);
  EXPECT_TRUE(run_conditions("[1").empty());
  const auto wrong = parse_campaign(
      R"({"name": "c", "model": {"name": "m", "effects": [{"effect": "gravity"}]},
          "runs": [{"frequency_hz": 2, "amplitude": 3, "conditions": {"gas_temperature": "5 turnips"}}]})",
      "c.json", ".");
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().what, testing::HasSubstr("/runs/0/conditions/gas_temperature"));
}

TEST(Campaign, SaysNoReferenceMassWhereThereIsNone) {
  EXPECT_EQ(reference_mass("{}"), 0.0);
  EXPECT_EQ(reference_mass(R"({"reference_mass": "heavy"})"), 0.0);
  EXPECT_EQ(reference_mass("[1"), 0.0);
}

TEST(Campaign, PassesOnWhatIsWrongWithItsModelFile) {
  const auto campaign = parse_campaign(
      R"({"name": "c", "model": "no-such.json", "runs": [{"frequency_hz": 2, "amplitude": 3}]})",
      "c.json", kCampaignExamples);
  ASSERT_FALSE(campaign);
  EXPECT_THAT(campaign.error().what, testing::HasSubstr("c.json:1: /model: the model file"));
  EXPECT_THAT(campaign.error().what, testing::HasSubstr("no-such.json: cannot be read"));
}

}  // namespace
}  // namespace shaker::config
