#include "sim/campaign_recorder.hpp"

#include <cmath>
#include <fstream>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shaker::sim {
namespace {

CampaignRecording two_runs() {
  CampaignRecording campaign;
  campaign.rig.noise_m = 0.0;
  campaign.rig.noise_m_s2 = 0.0;
  campaign.rig.quantum_m = 0.0;
  campaign.rig.quantum_m_s2 = 0.0;
  campaign.runs = {{"r01", 2.0, 3.0, false}, {"r02", 1.0, 3.0, true}};
  return campaign;
}

TEST(CampaignRecorder, RecordsTheRampTheTransientAndTheCyclesAskedFor) {
  const Record record = record_run(two_runs(), 0);
  ASSERT_EQ(record.t.size(), 9500u);  // 0.5 s + 18 cycles at 2 Hz, 1 kHz
  EXPECT_NEAR(record.t.back(), 9.5, 1e-9);
  EXPECT_NEAR(record.displacement.front(), (1 - 1.524 / 9.80665) / 5.31496, 1e-4);  // at rest
  const double t = record.t[9000];
  EXPECT_NEAR(record.excitation[9000], 3.0 * std::cos(2 * std::numbers::pi * 2.0 * t), 1e-9);
  EXPECT_NEAR(record.displacement[9000], record.displacement[8500], 1e-6);  // steady
}

TEST(CampaignRecorder, GivesEachRunItsOwnNoiseAndTheSameOneAgain) {
  CampaignRecording campaign = two_runs();
  campaign.rig.noise_m = 1e-4;
  campaign.runs[1] = campaign.runs[0];
  EXPECT_EQ(record_run(campaign, 0).displacement, record_run(campaign, 0).displacement);
  EXPECT_NE(record_run(campaign, 0).displacement, record_run(campaign, 1).displacement);
}

TEST(CampaignRecorder, WritesAFolderThatKeepsTheTruthToItself) {
  CampaignRecording campaign = two_runs();
  campaign.rig.parameters["coulomb_friction"] = 0.2;
  const auto folder = std::filesystem::temp_directory_path() / "shaker-campaign-recorder-test";
  write_campaign(campaign, folder);
  std::ifstream in(folder / "campaign.json");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  const auto document = nlohmann::json::parse(text);
  EXPECT_EQ(document.at("format"), "shaker-campaign/1");
  EXPECT_EQ(document.at("runs").at(1).at("role"), "held_out");
  EXPECT_THAT(text, ::testing::Not(::testing::HasSubstr("friction")));
  std::ifstream csv(folder / "r01.csv");
  std::string header, first;
  std::getline(csv, header);
  std::getline(csv, first);
  EXPECT_EQ(header, "t,excitation,displacement");
  EXPECT_THAT(first, ::testing::StartsWith("0.0010000,"));
  std::filesystem::remove_all(folder);
}

TEST(CampaignRecorder, SaysWhichRunTheRigRefusesOrBottoms) {
  CampaignRecording campaign = two_runs();
  campaign.runs[1].frequency_hz = 5000.0;
  EXPECT_THROW(record_run(campaign, 1), std::invalid_argument);
  campaign.runs[1] = {"r02", 1.0, 45.0, false};
  try {
    record_run(campaign, 1);
    FAIL() << "the damper should have bottomed";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("run r02: the rig tripped"));
  }
}

}  // namespace
}  // namespace shaker::sim
