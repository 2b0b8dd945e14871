#include "cli/campaign_folder.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::cli {
namespace {

namespace fs = std::filesystem;
using estimator::diagnosis::Campaign;
using estimator::diagnosis::Kind;
using estimator::diagnosis::Role;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class CampaignFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "campaign.XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    write("r01.csv", "t,excitation,displacement\n0,1,10\n1,2,20\n");
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  Result<Campaign> read(const std::string& text) {
    write("campaign.json", text);
    return read_campaign(folder_, model_);
  }
  // `run`: further members of the run; `document`: further members of the document.
  std::string trouble(const std::string& run, const std::string& document = "") {
    const auto read_in = read("{\"format\": \"shaker-campaign/1\",\n" + document +
                              "\"runs\": [{\"name\": \"r01\"" + run + "}]}");
    return read_in ? "none" : read_in.error().what;
  }

  fs::path folder_;
  config::ModelSpec model_;
};

TEST_F(CampaignFolder, PutsColumnsIntoTheModelsUnits) {
  const auto campaign = read(
      R"({"format": "shaker-campaign/1", "gravity": 1.62, // on the moon
          "units": {"time": "ms", "displacement": "mm", "excitation": {"label": "V", "scale": 5}},
          "runs": [{"name": "r01", "frequency_hz": 2, "amplitude": 3, "role": "held_out"}]})");
  ASSERT_TRUE(campaign) << campaign.error().what;
  ASSERT_EQ(campaign->runs.size(), 1U);
  const auto& run = campaign->runs[0];
  EXPECT_EQ(run.kind, Kind::periodic);
  EXPECT_EQ(run.role, Role::held_out);
  EXPECT_TRUE(run.role_given);
  EXPECT_EQ(run.frequency_hz, 2.0);
  EXPECT_EQ(run.amplitude, 15.0);
  EXPECT_THAT(run.t, ElementsAre(0.0, 1e-3));
  EXPECT_THAT(run.displacement, ElementsAre(0.01, 0.02));
  EXPECT_THAT(run.excitation, ElementsAre(5.0, 10.0));
  EXPECT_EQ(campaign->name, folder_.filename());
  EXPECT_EQ(model_.gravity, 1.62);
  EXPECT_EQ(campaign->warnings.size(), 1U);
}

TEST_F(CampaignFolder, ReadsUnitsFromTheHeaderRow) {
  write("r01.csv", "t [min],excitation [g],displacement (in),acceleration\n0,1,10,2\n1,2,20,2\n");
  const auto campaign = read(R"({"format": "shaker-campaign/1",
          "runs": [{"name": "r01", "frequency_hz": 2, "amplitude": 2}]})");
  ASSERT_TRUE(campaign) << campaign.error().what;
  const auto& run = campaign->runs.at(0);
  EXPECT_THAT(run.t, ElementsAre(0.0, 60.0));
  EXPECT_THAT(run.displacement, ElementsAre(0.254, 0.508));
  EXPECT_THAT(run.excitation, ElementsAre(9.80665, 19.6133));
  EXPECT_DOUBLE_EQ(run.acceleration.at(0), 19.6133) << "as the table's";
  EXPECT_DOUBLE_EQ(run.amplitude, 19.6133);
  EXPECT_EQ(trouble(", \"frequency_hz\": 2", R"("units": {"displacement": "in"}, )"), "none");
  EXPECT_THAT(
      trouble(", \"frequency_hz\": 2", R"("units": {"displacement": "mm"}, )"),
      HasSubstr("r01.csv:1: column \"displacement\": is in \"in\" by the header row, and in "
                "another unit by /units of campaign.json"));
  write("r01.csv", "t,excitation,displacement [furlong]\n0,1,10\n1,2,20\n");
  EXPECT_THAT(trouble(", \"frequency_hz\": 2"),
              HasSubstr("r01.csv:1: column \"displacement\": \"furlong\" and the model's \"m\" do "
                        "not match; known are m, cm, mm, um, in, ft. Convert the column"));
}

TEST_F(CampaignFolder, FindsColumnsUnderNamesOfTheirOwn) {
  write("r01.csv", "stamp,pos_mm,shake,displacement\n0,10,1,7\n1,20,2,7\n");
  const auto campaign = read(
      R"({"format": "shaker-campaign/1", "units": {"displacement": "mm"},
          "columns": {"t": "stamp", "displacement": "pos_mm", "excitation": "shake"},
          "runs": [{"name": "r01", "frequency_hz": 2}]})");
  ASSERT_TRUE(campaign) << campaign.error().what;
  const auto& run = campaign->runs.at(0);
  EXPECT_THAT(run.t, ElementsAre(0.0, 1.0));
  EXPECT_THAT(run.displacement, ElementsAre(0.01, 0.02));
  EXPECT_THAT(run.excitation, ElementsAre(1.0, 2.0));
}

TEST_F(CampaignFolder, SaysWhichMappedColumnIsNotThere) {
  EXPECT_THAT(trouble("", R"("columns": {"displacement": "pos_mm"},)"), HasSubstr("pos_mm"));
  EXPECT_THAT(trouble("", R"("columns": {"acceleration": "acc"},)"), HasSubstr("acc"));
  EXPECT_THAT(trouble("", R"("columns": {"displacment": "pos"},)"),
              AllOf(HasSubstr("/columns/displacment"), HasSubstr("did you mean")));
  EXPECT_THAT(trouble("", R"("columns": {"displacement": "a", "excitation": "a"},)"),
              HasSubstr("is another channel too"));
  EXPECT_EQ(trouble("", R"("columns": {"excitation": "excitation"},)"), "none");
}

TEST_F(CampaignFolder, SaysWhichKeyIsMisspelt) {
  EXPECT_THAT(trouble("", R"("units": {"displacment": "mm"},)"),
              AllOf(HasSubstr("campaign.json:2: /units/displacment"),
                    HasSubstr("did you mean \"displacement\"?")));
  EXPECT_THAT(trouble(R"(, "rolle": "fit")"),
              AllOf(HasSubstr("/runs/0/rolle"), HasSubstr("did you mean \"role\"?")));
  EXPECT_THAT(trouble("", R"("unitz": {},)"), HasSubstr("did you mean \"units\"?"));
}

TEST_F(CampaignFolder, SaysWhatIsExpectedInsteadOfAnotherType) {
  EXPECT_THAT(trouble(R"(, "frequency_hz": "2")"),
              HasSubstr("/runs/0/frequency_hz: \"2\" is not a number"));
  EXPECT_THAT(trouble("", R"("gravity": "9.8",)"), HasSubstr("/gravity: \"9.8\" is not a number"));
  EXPECT_THAT(trouble("", R"("gravity": -9.8,)"), HasSubstr("/gravity: -9.8 is out of range"));
  EXPECT_THAT(trouble("", R"("units": "mm",)"), HasSubstr("/units: is \"mm\"; an object"));
  EXPECT_THAT(trouble("", R"("units": {"force": 3},)"),
              HasSubstr("/units/force: 3 is neither a unit nor an object"));
  EXPECT_THAT(trouble(R"(, "kind": "sine")"), HasSubstr("allowed are periodic, imposed_motion"));
  EXPECT_THAT(trouble(R"(, "role": "test")"), HasSubstr("allowed are fit, held_out"));
  for (const char* text : {R"({"format": "shaker-campaign/1", "runs": ["r01"]})",
                           R"({"format": "shaker-campaign/1", "runs": {"a": 1}})",
                           R"({"format": "shaker-campaign/1", "runs": [{"name": "r01", "frequenc)",
                           R"({"runs": [{"name": "r01"}]})", "[]", ""}) {
    const auto campaign = read(text);
    ASSERT_FALSE(campaign) << text;
    EXPECT_THAT(campaign.error().what, AllOf(HasSubstr("campaign.json:1"), Not(HasSubstr("[json"))))
        << text;
  }
}

TEST_F(CampaignFolder, SaysWhatDoesNotMatch) {
  EXPECT_THAT(trouble("", R"("units": {"displacement": "V"},)"),
              HasSubstr("say {\"label\": \"V\", \"scale\": ...}"));
  EXPECT_THAT(trouble("", R"("units": {"force": "kN"},)"), HasSubstr("give /reference_mass in kg"));
  EXPECT_THAT(trouble(R"(, "file": "../r01.csv")"), HasSubstr("not in the campaign's folder"));
  EXPECT_THAT(trouble(R"(}, {"name": "r01")"), HasSubstr("/runs/1/name: \"r01\" is the name of"));
  EXPECT_EQ(trouble("", R"("units": {"force": "kN"}, "reference_mass": 100,)"), "none");
}

TEST_F(CampaignFolder, SaysWhichRunIsThereTwice) {
  const auto runs = [](const std::string& second) {
    return R"({"format": "shaker-campaign/1", "runs": [{"name": "r01"}, )" + second + "]}";
  };
  const auto named = read(runs(R"({"name": "r01", "frequency_hz": 2})"));
  ASSERT_FALSE(named);
  EXPECT_THAT(named.error().what, AllOf(HasSubstr("/runs/1/name"), Not(HasSubstr("/runs/1/file"))));
  const auto measured = read(runs(R"({"name": "again", "file": "r01.csv"})"));
  ASSERT_FALSE(measured);
  EXPECT_THAT(measured.error().what, AllOf(HasSubstr("/runs/1/file"), HasSubstr("count twice")));
}

TEST_F(CampaignFolder, ConvertsAnglesToTheModels) {
  model_.length_unit = "rad";
  write("campaign.json", R"({"format": "shaker-campaign/1",
    "units": {"displacement": "deg", "excitation": "deg/s^2"}, "runs": [{"name": "r01"}]})");
  const auto campaign = read_campaign(folder_, model_);
  ASSERT_TRUE(campaign) << campaign.error().what;
  const double degree = std::numbers::pi / 180.0;
  EXPECT_NEAR(campaign->runs.at(0).displacement.at(1), 20.0 * degree, 1e-12);
  EXPECT_NEAR(campaign->runs.at(0).excitation.at(1), 2.0 * degree, 1e-12);
  EXPECT_THAT(trouble("", R"("units": {"displacement": "mm"},)"),
              HasSubstr("the model's \"rad\" do not match; known are rad, mrad, deg"));
}

TEST_F(CampaignFolder, RefusesADatabaseWhereTheModelCountsInFeet) {
  model_.length_unit = "ft";
  const auto read_in = read_campaign(folder_ / "bench.db", model_);
  ASSERT_FALSE(read_in);
  EXPECT_THAT(read_in.error().what, HasSubstr("give a model in metres"));
}

TEST_F(CampaignFolder, SaysWhereANumberIsTooLarge) {
  write("r01.csv", "t,excitation,displacement\n0,1,10\n1,2,1.5e299\n");
  EXPECT_THAT(trouble(""),
              AllOf(HasSubstr("r01.csv:3:3: \"1.5e299\""), HasSubstr("(displacement)")));
}

}  // namespace
}  // namespace shaker::cli
