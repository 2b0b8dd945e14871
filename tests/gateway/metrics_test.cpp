#include "gateway/metrics.hpp"

#include <gmock/gmock.h>

#include "tests/gateway/documents.hpp"

namespace shaker::gateway {
namespace {

using ::testing::HasSubstr;
using testing::line;
using ::testing::Not;

TEST(Metrics, OfADaemonThatIsAwaySayOnlyThat) {
  Feed feed;
  feed.begin("1");
  feed.take(testing::state(1, "MEASURE"));
  feed.lose("away");
  const std::string text = metrics({{"", &feed}}, {3, 1});
  EXPECT_THAT(text, HasSubstr("\nshaker_up 0\n"));
  EXPECT_THAT(text, HasSubstr("\nshaker_gateway_browsers 3\n"));
  EXPECT_THAT(text, Not(HasSubstr("shaker_state")));
}

TEST(Metrics, HaveEachFamilyOnceAndEscapeWhatComesFromOutside) {
  Feed feed;
  feed.begin("1");
  feed.take(line("version", 1, {{"rig", "a \"b\"\\c\nd"}, {"version", "1"}}));
  feed.take(testing::state(2, "MEASURE"));
  feed.take(testing::alarm(3, "error", "stroke_limit"));
  feed.take(line("health", 4,
                 {{"lost", 7},
                  {"exciter_connected", true},
                  {"channels",
                   {{{"channel", "displacement"}, {"unit", "m"}, {"value", 0.125}},
                    {{"channel", "aux1"}, {"name", "oil"}, {"unit", "degC"}, {"value", 40}}}}}));
  feed.take(line("estimate", 5,
                 {{"campaign", "c"},
                  {"usable", true},
                  {"parameters",
                   {{{"name", "theta1"}, {"unit", "1/m"}, {"value", 16.5}, {"standard_error", 0.5}},
                    {{"name", "g"}, {"unit", "m/s^2"}, {"value", 9.80665}}}}}));
  const std::string text = metrics({{"", &feed}}, {});
  EXPECT_THAT(text, HasSubstr("rig=\"a \\\"b\\\"\\\\c\\nd\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("shaker_state{state=\"MEASURE\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("shaker_state{state=\"FAULT\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("shaker_alarms{severity=\"error\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("\nshaker_samples_lost_total 7\n"));
  EXPECT_THAT(text, HasSubstr("shaker_channel_value{channel=\"oil\",unit=\"degC\"} 40\n"));
  EXPECT_THAT(
      text, HasSubstr("shaker_parameter{campaign=\"c\",parameter=\"theta1\",unit=\"1/m\"} 16.5\n"));
  std::istringstream lines(text);
  std::set<std::string> families;
  for (std::string one; std::getline(lines, one);) {
    ASSERT_FALSE(one.empty());
    if (one.starts_with("# TYPE ")) {
      EXPECT_TRUE(families.insert(one).second) << one;
    }
  }
  EXPECT_EQ(families.size(), 15U);
}

}  // namespace
}  // namespace shaker::gateway
