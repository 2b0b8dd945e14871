#include "daemon/service/recovery_report.hpp"

#include <new>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::daemon {
namespace {

using ::testing::HasSubstr;

struct RecoveryReport : ::testing::Test {
  std::vector<protocol::AlarmDocument> told;
  void report(const RecoveryCheck& check) {
    report_recovery("/data/c.db", check,
                    [this](const protocol::AlarmDocument& alarm) { told.push_back(alarm); });
  }
  static RecoveryCheck finds(const record::Recovered& found) {
    return [found](const std::filesystem::path&) { return found; };
  }
};

TEST_F(RecoveryReport, SaysNothingOfAFinishedCampaign) {
  report([](const std::filesystem::path&) { return std::nullopt; });
  EXPECT_TRUE(told.empty());
}

TEST_F(RecoveryReport, TellsDamageFromInterruptionAndFromWhatCannotBeRead) {
  record::Recovered found;
  found.what = "c.db cannot be read.";
  report(finds(found));
  found.campaign = "c";
  report(finds(found));
  found.damaged = true;
  report(finds(found));
  ASSERT_EQ(told.size(), 3u);
  EXPECT_EQ(told[0].code, "campaign_unreadable");
  EXPECT_EQ(told[1].code, "campaign_interrupted");
  EXPECT_EQ(told[1].severity, "warning");
  EXPECT_EQ(told[2].code, "campaign_damaged");
  EXPECT_EQ(told[2].severity, "error");
  EXPECT_EQ(told[2].text, "c.db cannot be read.");
}

TEST_F(RecoveryReport, OutlivesWantOfMemoryAndSaysWhichFileIsUnchecked) {
  report([](const std::filesystem::path&) -> std::optional<record::Recovered> {
    throw std::bad_alloc();
  });
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].code, "campaign_unreadable");
  EXPECT_THAT(told[0].text, HasSubstr("/data/c.db: cannot be checked"));
  EXPECT_THAT(told[0].text, HasSubstr("start the daemon again"));
}

TEST_F(RecoveryReport, OutlivesThatNotEvenThatCanBeSaid) {
  int tries = 0;
  report_recovery(
      "/data/c.db",
      [](const std::filesystem::path&) -> std::optional<record::Recovered> { throw 1; },
      [](const protocol::AlarmDocument&) {});
  report_recovery("/data/c.db", finds({}), [&](const protocol::AlarmDocument&) {
    ++tries;
    throw std::bad_alloc();
  });
  EXPECT_EQ(tries, 2);
}

}  // namespace
}  // namespace shaker::daemon
