#include "protocol/standing_alarms.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace shaker::protocol {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;

json alarm(const char* severity, const std::string& code, const std::string& text = "text",
           const char* utc = "2026-03-01T12:34:56.789Z") {
  return {
      {"type", "alarm"}, {"severity", severity}, {"code", code}, {"text", text}, {"t_utc", utc}};
}

std::vector<std::string> codes(const StandingAlarms& alarms) {
  std::vector<std::string> found;
  for (const StandingAlarm& one : alarms.by_severity())
    found.push_back(one.code);
  return found;
}

TEST(StandingAlarms, StayWithTheirFirstTimeUntilTheyAreAcknowledged) {
  StandingAlarms alarms;
  EXPECT_FALSE(alarms.take(alarm("warning", "slow")));
  EXPECT_TRUE(alarms.take(alarm("error", "limit", "first"), "the line"));
  EXPECT_TRUE(alarms.take(alarm("error", "limit", "second", "2026-03-01T13:00:00.000Z")));
  EXPECT_FALSE(alarms.take({{"type", "state"}, {"state", "IDLE"}}));
  EXPECT_FALSE(alarms.take(alarm("info", "at_rest")));
  EXPECT_THAT(codes(alarms), ElementsAre("limit", "slow"));
  const StandingAlarm& limit = alarms.all().back();
  EXPECT_EQ(limit.text, "second");
  EXPECT_EQ(limit.since_utc, "2026-03-01T12:34:56.789Z");
  EXPECT_EQ(limit.times, 2);
  EXPECT_EQ(limit.line, "the line");
  alarms.take(alarm("info", "acknowledged"));
  EXPECT_TRUE(alarms.all().empty());
}

TEST(StandingAlarms, OfSeverityWarningEndWhenACampaignBegins) {
  StandingAlarms alarms;
  alarms.take(alarm("warning", "slow"));
  alarms.take(alarm("error", "check_sensor"));
  alarms.take(alarm("info", "warnings_set_aside"));
  EXPECT_THAT(codes(alarms), ElementsAre("check_sensor"));
}

TEST(StandingAlarms, AboutTwoFilesAreTwo) {
  StandingAlarms alarms;
  alarms.take(alarm("warning", "campaign_interrupted", "a.db"));
  alarms.take(alarm("warning", "campaign_interrupted", "b.db"));
  alarms.take(alarm("warning", "campaign_interrupted", "a.db"));
  EXPECT_EQ(alarms.all().size(), 2u);
}

TEST(StandingAlarms, AreAFewOfWhichErrorsStayLongest) {
  StandingAlarms alarms;
  alarms.take(alarm("error", "first"));
  for (int i = 0; i < 100; ++i)
    alarms.take(alarm("warning", "w" + std::to_string(i)));
  EXPECT_EQ(alarms.all().size(), StandingAlarms::kMost);
  EXPECT_EQ(codes(alarms).front(), "first");
  EXPECT_EQ(codes(alarms).back(), "w99");
  for (int i = 0; i < 100; ++i)
    alarms.take(alarm("error", "e" + std::to_string(i)));
  EXPECT_EQ(alarms.all().size(), StandingAlarms::kMost);
  EXPECT_EQ(codes(alarms).back(), "e99");
}

TEST(StandingAlarms, TakeRubbishForNothing) {
  StandingAlarms alarms;
  for (const json& rubbish : {json(), json(1), json::array({1}), json{{"type", 5}},
                              json{{"type", "alarm"}}, json{{"type", "alarm"}, {"severity", {}}}})
    EXPECT_FALSE(alarms.take(rubbish));
  EXPECT_TRUE(alarms.all().empty());
}

}  // namespace
}  // namespace shaker::protocol
