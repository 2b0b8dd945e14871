#include "gateway/feed.hpp"

#include <gmock/gmock.h>

#include "tests/gateway/documents.hpp"

namespace shaker::gateway {
namespace {

using nlohmann::json;
using testing::alarm;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::line;
using ::testing::StartsWith;
using testing::state;

// "daemon", "reset", "version", "cycle 7", ...: what a browser gets, with its id.
std::vector<std::string> names(const std::vector<Event>& events) {
  std::vector<std::string> all;
  for (const Event& event : events) {
    const std::string& text = *event.text;
    EXPECT_TRUE(text.ends_with("\n\n"));
    const auto id = text.starts_with("id: ") ? text.substr(4, text.find('\n') - 4) : "";
    const auto named = text.find("event: ");
    const auto data = text.find("data: ");
    std::string name = named < data ? text.substr(named + 7, text.find('\n', named) - named - 7)
                                    : json::parse(text.substr(data + 6)).value("type", "?");
    all.push_back(id.empty() ? name : name + " " + id);
  }
  return all;
}

class FeedTest : public ::testing::Test {
 protected:
  FeedTest() {
    feed.begin("life-1");
    feed.take(line("version", 10, {{"rig", "A"}}));
    feed.take(state(9, "IDLE"));
  }
  Feed feed;
};

TEST_F(FeedTest, ALateJoinerGetsTheCampaignSoFar) {
  feed.take(state(11, "CHECK"));
  feed.take(line("run_start", 12));
  feed.take(state(13, "MEASURE"));
  feed.take(line("cycle", 14));
  feed.take(line("estimate", 15));
  feed.take(line("health", 16));
  feed.take(line("wave", 16));
  feed.take(line("scope", 16));
  EXPECT_THAT(names(feed.opening(std::nullopt)),
              ElementsAre("daemon", "reset", "version", "state", "run_start 12", "cycle 14",
                          "estimate 15", "health", "wave", "ready 16"));
}

TEST_F(FeedTest, ABrowserThatComesAgainGetsWhatIsNewer) {
  feed.take(line("cycle", 11));
  feed.take(line("estimate", 12));
  EXPECT_THAT(names(feed.opening(11)),
              ElementsAre("daemon", "version", "state", "estimate 12", "ready 12"));
  // Numbers that are older or newer than all that is known: another life of the daemon.
  EXPECT_THAT(names(feed.opening(500)), ::testing::Contains("reset"));
  EXPECT_THAT(names(feed.opening(3)), ::testing::Contains("reset"));
}

TEST_F(FeedTest, GivesEachNumberedDocumentItsNumberAndOthersNone) {
  EXPECT_THAT(*feed.take(line("cycle", 11))->text, StartsWith("id: 11\ndata: {"));
  EXPECT_THAT(*feed.take(line("wave", 11))->text, StartsWith("data: {"));
  EXPECT_FALSE(feed.take(line("cycle", 12))->droppable);
  EXPECT_TRUE(feed.take(line("scope", 12))->droppable);
  EXPECT_FALSE(feed.take(R"({"jsonrpc":"2.0","id":1,"result":{}})"));
  EXPECT_FALSE(feed.take(R"({"type":"missed","count":3})"));
  EXPECT_FALSE(feed.take("not JSON"));
  EXPECT_FALSE(feed.take(R"([1, 2])"));
}

TEST_F(FeedTest, KeepsAlarmsUntilTheDaemonSaysThatTheyHaveEnded) {
  feed.take(alarm(11, "error", "stroke_limit"));
  feed.take(state(12, "FAULT"));
  feed.take(alarm(13, "warning", "creeping"));
  EXPECT_EQ(feed.alarms("error"), 1);
  EXPECT_THAT(names(feed.opening(std::nullopt)), ::testing::IsSupersetOf({"alarm 11", "alarm 13"}));
  feed.take(state(14, "IDLE"));
  EXPECT_EQ(feed.alarms("error") + feed.alarms("warning"), 2);
  feed.take(alarm(15, "info", "acknowledged"));
  EXPECT_EQ(feed.alarms("error") + feed.alarms("warning"), 0);
  EXPECT_THAT(names(feed.opening(13)), ::testing::Contains("alarm 15")) << "whoever comes back";
  feed.take(alarm(16, "info", "at_rest"));
  feed.take(alarm(17, "warning", "sensor_link"));
  feed.take(alarm(18, "error", "check_noise"));
  feed.take(alarm(19, "info", "warnings_set_aside"));
  feed.take(state(20, "CHECK"));
  EXPECT_EQ(feed.alarms("warning"), 0);
  EXPECT_EQ(feed.alarms("error"), 1);
  EXPECT_EQ(feed.alarms("info"), 2) << "only what ends alarms";
}

TEST_F(FeedTest, APausedCampaignGoesOn) {
  feed.take(state(11, "CHECK"));
  feed.take(line("cycle", 12));
  feed.take(state(13, "PAUSE"));
  feed.take(state(14, "CHECK"));
  EXPECT_THAT(names(feed.opening(std::nullopt)), ::testing::Contains("cycle 12"));
}

TEST_F(FeedTest, ANewCampaignForgetsTheOldOne) {
  feed.take(line("cycle", 11));
  feed.take(line("estimate", 12));
  feed.take(line("wave", 12));
  feed.take(state(13, "CHECK"));
  EXPECT_THAT(names(feed.opening(std::nullopt)),
              ElementsAre("daemon", "reset", "version", "state", "ready 13"));
  EXPECT_EQ(feed.last("estimate"), nullptr);
  EXPECT_THAT(names(feed.opening(11)), ::testing::Contains("reset"));
}

TEST_F(FeedTest, OfOlderEstimatesTheMatricesGo) {
  const json more = {{"parameters", {{{"name", "theta1"}, {"value", 1.5}}}},
                     {"covariance", {{1.0}}},
                     {"warnings", {"one"}}};
  feed.take(line("estimate", 11, more));
  feed.take(line("estimate", 12, more));
  const auto events = feed.opening(10);
  ASSERT_EQ(names(events)[3], "estimate 11");
  EXPECT_THAT(*events[3].text, HasSubstr("\"theta1\""));
  EXPECT_THAT(*events[3].text, ::testing::Not(HasSubstr("covariance")));
  EXPECT_THAT(*events[4].text, HasSubstr("covariance"));
}

TEST_F(FeedTest, HasABoundAndSaysSoToWhoeverComesAgain) {
  feed = Feed(100'000);
  feed.begin("life-2");
  feed.take(line("version", 0));
  feed.take(alarm(1, "error", "first"));
  for (std::uint64_t seq = 2; seq < 2000; ++seq)
    feed.take(line("cycle", seq, {{"why", std::string(200, 'x')}}));
  std::size_t bytes = 0;
  for (const Event& event : feed.opening(std::nullopt))
    bytes += event.text->size();
  EXPECT_LT(bytes, 102'000U);
  EXPECT_GT(bytes, 50'000U);
  EXPECT_EQ(feed.alarms("error"), 1);
  EXPECT_THAT(names(feed.opening(5)), ::testing::Contains("reset"));
  EXPECT_THAT(names(feed.opening(1990)), ::testing::Not(::testing::Contains("reset")));
}

TEST_F(FeedTest, SaysWhyTheDaemonIsAway) {
  EXPECT_TRUE(feed.connected());
  const Event event = feed.lose("shakerd closed the \"connection\"\nnow");
  EXPECT_FALSE(feed.connected());
  EXPECT_THAT(*event.text, StartsWith("event: daemon\ndata: {"));
  const auto said = json::parse(event.text->substr(event.text->find("data: ") + 6));
  EXPECT_EQ(said["connected"], false);
  EXPECT_EQ(said["life"], "life-1");
  EXPECT_THAT(said["why"].get<std::string>(), HasSubstr("closed"));
  EXPECT_FALSE(Feed().connected());
}

}  // namespace
}  // namespace shaker::gateway
