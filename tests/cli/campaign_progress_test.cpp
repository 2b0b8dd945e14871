#include "cli/campaign_progress.hpp"

#include <gtest/gtest.h>

namespace shaker::cli {
namespace {

using Json = nlohmann::json;

config::CampaignSpec two_runs() {
  config::CampaignSpec campaign;
  campaign.runs = {{"slow", 1.0, 2.0, 4}, {"fast", 2.0, 2.0, 6}};
  return campaign;
}
Json state(const char* name) {
  return {{"type", "state"}, {"state", name}};
}
Json cycle(bool accepted) {
  return {{"type", "cycle"}, {"accepted", accepted}};
}
Json run_stop(const char* status) {
  return {{"type", "run_stop"}, {"status", status}};
}
Json run_start(int index) {
  return {{"type", "run_start"}, {"run_index", index}};
}

TEST(CampaignProgress, IsOverOnlyAfterItHasBegun) {
  const auto campaign = two_runs();
  CampaignProgress progress(campaign);
  progress.take(state("IDLE"), 0.0);
  EXPECT_FALSE(progress.over());
  progress.take(state("CHECK"), 0.1);
  EXPECT_FALSE(progress.over());
  progress.take(state("IDLE"), 0.2);
  EXPECT_TRUE(progress.over());
  EXPECT_FALSE(progress.success());  // no run was done
}

TEST(CampaignProgress, SaysWhyARunFailedAndNotThatTheCampaignIsComplete) {
  const auto campaign = two_runs();
  CampaignProgress progress(campaign);
  progress.take(state("CHECK"), 0.0);
  progress.take(run_start(0), 0.1);
  Json failed = run_stop("fail");
  failed["reason"] = "no steady state after 8 cycles";
  progress.take(failed, 1.0);
  progress.take(run_start(1), 1.1);
  progress.take(run_stop("success"), 2.0);
  Json idle = state("IDLE");
  idle["reason"] = "campaign \"demo\" is complete";
  progress.take(idle, 2.1);
  EXPECT_TRUE(progress.over());
  EXPECT_FALSE(progress.success());
  EXPECT_EQ(progress.reason(), "no steady state after 8 cycles");
}

TEST(CampaignProgress, SucceedsWhenEveryRunDid) {
  const auto campaign = two_runs();
  CampaignProgress progress(campaign);
  progress.take(state("CHECK"), 0.0);
  progress.take(run_stop("success"), 1.0);
  progress.take(run_stop("success"), 2.0);
  progress.take(state("RAMP_DOWN"), 2.0);
  EXPECT_FALSE(progress.success());
  progress.take(state("IDLE"), 3.0);
  EXPECT_TRUE(progress.success());
  progress.take(state("FAULT"), 3.0);
  EXPECT_FALSE(progress.success());
}

TEST(CampaignProgress, CountsAcceptedCyclesAndWaitsForTheLastEstimate) {
  const auto campaign = two_runs();
  CampaignProgress progress(campaign);
  progress.take(run_start(0), 0.0);
  progress.take(cycle(false), 2.0);
  EXPECT_EQ(progress.fraction(), 0.0);
  progress.take(cycle(true), 3.0);
  progress.take(cycle(true), 4.0);
  EXPECT_DOUBLE_EQ(progress.fraction(), 0.2);
  EXPECT_FALSE(progress.estimate_is_in());
  progress.take({{"type", "estimate"}, {"usable", true}}, 4.0);
  EXPECT_FALSE(progress.estimate_is_in());
  progress.take({{"type", "estimate"}, {"usable", false}}, 4.0);
  EXPECT_TRUE(progress.estimate_is_in());
  EXPECT_FALSE(progress.last_estimate()["usable"].get<bool>());
}

// The first run needed 3 s to settle; the same is expected for the second run.
TEST(CampaignProgress, LearnsFromTheFirstRunHowLongTheNextWillTake) {
  const auto campaign = two_runs();
  CampaignProgress progress(campaign);
  progress.take(run_start(0), 10.0);
  progress.take(cycle(true), 13.0);
  EXPECT_DOUBLE_EQ(progress.eta_s(13.0), 3 / 1.0 + 3.0 + 6 / 2.0);
  progress.take(run_start(1), 20.0);
  EXPECT_DOUBLE_EQ(progress.eta_s(21.0), 6 / 2.0 + 2.0);
}

}  // namespace
}  // namespace shaker::cli
