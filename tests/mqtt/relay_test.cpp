#include "mqtt/relay.hpp"

#include <gmock/gmock.h>

#include "tests/gateway/documents.hpp"

namespace shaker::mqtt {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::string timed(const std::string& type, std::uint64_t seq, std::int64_t t_mono_ns,
                  json more = json::object()) {
  more["t_mono_ns"] = t_mono_ns;
  return gateway::testing::line(type, seq, std::move(more));
}
std::string alarm(std::uint64_t seq, std::int64_t t_mono_ns, const std::string& severity,
                  const std::string& code) {
  return timed("alarm", seq, t_mono_ns,
               {{"severity", severity},
                {"code", code},
                {"text", "A \"sentence\"."},
                {"t_utc", "2026-01-01T00:00:00.000Z"}});
}

class RelayTest : public ::testing::Test {
 protected:
  RelayTest() {
    relay.connected();
    EXPECT_EQ(relay.take(timed("version", 1, 1, {{"rig", "oleo"}}), {}), "oleo");
    outbox.begin_connection();
    EXPECT_THAT(codes(), ElementsAre("online"));
  }
  // What is handed over: the code of an alarm, the type of another document, the word of `bridge`.
  std::vector<std::string> codes() {
    std::vector<std::string> all;
    while (const auto one = outbox.next(Nanoseconds(5'000'000'000))) {
      outbox.confirmed(one->ticket);
      if (one->kind == Kind::bridge) {
        all.push_back(one->payload);
        continue;
      }
      last = json::parse(one->payload);
      all.push_back(last.value("code", last["type"].get<std::string>()));
    }
    return all;
  }
  Outbox outbox;
  Relay relay{outbox};
  json last;
};

TEST_F(RelayTest, PublishesWhatTheDaemonWroteWithItsAge) {
  const std::string line = timed("state", 7, 3'000'000'000, {{"state", "IDLE"}, {"x", 1e-5}});
  EXPECT_FALSE(relay.take(line, {}));
  EXPECT_THAT(codes(), ElementsAre("state"));
  auto wanted = json::parse(line);
  wanted["age_s"] = 2.0;
  EXPECT_EQ(last, wanted);
}

TEST_F(RelayTest, PassesOverWhatIsForOthers) {
  for (const char* line : {"not JSON", "[1]", R"({"jsonrpc":"2.0","id":1,"result":{}})", "{}",
                           R"({"type":"cycle","seq":8})", R"({"type":7})"})
    EXPECT_FALSE(relay.take(line, {})) << line;
  EXPECT_THAT(codes(), IsEmpty());
  relay.lost();
  EXPECT_THAT(codes(), ElementsAre("daemon_lost"));
}

TEST_F(RelayTest, TheHealthHasTheAlarmsThatStand) {
  relay.take(alarm(2, 10, "error", "stroke_limit"), {});
  relay.take(alarm(3, 20, "warning", "sensor_link"), {});
  relay.take(timed("health", 4, 4'000'000'000), {});
  EXPECT_THAT(codes(), ElementsAre("stroke_limit", "sensor_link", "health"));
  EXPECT_EQ(last["alarms_standing"], (json{{{"code", "stroke_limit"},
                                            {"severity", "error"},
                                            {"since_utc", "2026-01-01T00:00:00.000Z"},
                                            {"text", "A \"sentence\"."}},
                                           {{"code", "sensor_link"},
                                            {"severity", "warning"},
                                            {"since_utc", "2026-01-01T00:00:00.000Z"},
                                            {"text", "A \"sentence\"."}}}));
  EXPECT_EQ(last["age_s"], 1.0);
  relay.take(alarm(5, 30, "info", "acknowledged"), {});
  relay.take(timed("health", 6, 40), {});
  EXPECT_THAT(codes(), ElementsAre("acknowledged", "health"));
  EXPECT_EQ(last["alarms_standing"], json::array());
}

TEST_F(RelayTest, AnAlarmThatTheDaemonRepeatsIsPublishedOnce) {
  relay.take(alarm(5, 100, "error", "stroke_limit"), {});
  relay.take(alarm(6, 100, "warning", "sensor_link"), {});
  EXPECT_THAT(codes(), ElementsAre("stroke_limit", "sensor_link"));
  relay.lost();
  relay.connected();
  relay.take(timed("version", 9, 1, {{"rig", "oleo"}}), {});
  relay.take(alarm(6, 100, "warning", "sensor_link"), {});
  relay.take(alarm(5, 100, "error", "stroke_limit"), {});
  relay.take(alarm(7, 110, "error", "came_meanwhile"), {});
  relay.take(timed("health", 8, 120), {});
  EXPECT_THAT(codes(), ElementsAre("online", "came_meanwhile", "health"));
  EXPECT_EQ(last["alarms_standing"].size(), 3U) << "repeated, and standing";
  // Another life of the daemon: numbers begin anew, the clock goes on.
  relay.connected();
  relay.take(alarm(1, 500, "error", "after_a_restart"), {});
  relay.take(timed("health", 2, 600), {});
  EXPECT_THAT(codes(), ElementsAre("after_a_restart", "health"));
  EXPECT_EQ(last["alarms_standing"].size(), 1U);
}

}  // namespace
}  // namespace shaker::mqtt
