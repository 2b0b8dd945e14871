// Documents that a client asks for: wave, scope and rig.
#include "tests/daemon/publish/server_fixture.hpp"

namespace shaker::daemon {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TestClient;
using testing::types;

class StreamExtrasTest : public testing::StreamServerTest {
 protected:
  void show(int cycle, std::size_t points = 64) {
    protocol::WaveDocument wave;
    wave.cycle = cycle;
    wave.stroke_m.assign(points, 0.1);
    server->publish_extra(wave);
    turn();
  }
  json subscribe(TestClient& client, const std::string& documents) {
    client.send(R"({"jsonrpc":"2.0","id":1,"method":"subscribe","params":{"documents":)" +
                documents + "}}\n");
    turn();
    for (const json& line : client.lines()) {
      if (line.contains("jsonrpc")) return line;
      before_answer.push_back(line);
    }
    return {};
  }
  std::vector<json> before_answer;
};

TEST_F(StreamExtrasTest, GoOnlyToThoseWhoAsked) {
  TestClient plain(socket), asking(socket);
  turn();
  plain.lines(), asking.lines();
  EXPECT_FALSE(server->wants("wave"));
  EXPECT_EQ(subscribe(asking, R"(["wave"])")["result"]["documents"], json({"wave"}));
  EXPECT_TRUE(server->wants("wave"));
  EXPECT_FALSE(server->wants("scope"));
  publish(7, "cycle");
  show(3);
  server->publish_extra(protocol::ScopeDocument{});
  turn();
  EXPECT_THAT(types(plain.lines()), ElementsAre("cycle"));
  const auto lines = asking.lines();
  ASSERT_THAT(types(lines), ElementsAre("cycle", "wave"));
  EXPECT_EQ(lines[1]["cycle"], 3);
  EXPECT_EQ(lines[1]["seq"], 7);  // of the newest numbered document
  EXPECT_TRUE(subscribe(asking, "[]").contains("result"));
  show(4);
  EXPECT_THAT(asking.lines(), IsEmpty());
}

TEST_F(StreamExtrasTest, ALateSubscriberGetsTheNewestWaveAndRig) {
  protocol::RigDocument rig_document;
  rig_document.rig = "rig A";
  server->publish_extra(rig_document);
  show(1);
  show(2);
  TestClient client(socket);
  turn();
  subscribe(client, R"(["rig", "wave", "scope"])");
  ASSERT_THAT(types(before_answer), ElementsAre("version", "wave", "rig"));
  EXPECT_EQ(before_answer[1]["cycle"], 2);
}

TEST_F(StreamExtrasTest, ANewCampaignForgetsTheWaveOfTheOldOne) {
  show(1);
  server->publish({5, "state", R"({"type":"state","seq":5,"state":"CHECK"})"});
  TestClient client(socket);
  turn();
  subscribe(client, R"(["wave"])");
  EXPECT_THAT(types(before_answer), ElementsAre("version", "state"));
}

TEST_F(StreamExtrasTest, AreLeftOutForAClientThatLagsWhichIsNotDropped) {
  TestClient client(socket);
  turn();
  subscribe(client, R"(["wave"])");
  constexpr int kWaves = 3000;  // some 3 KB each: more than the kernel and the limit hold
  for (int i = 0; i < kWaves; ++i)
    show(i, 400);
  publish(9, "cycle");
  std::vector<json> lines;
  for (auto more = client.lines(); !more.empty(); more = client.lines()) {
    lines.insert(lines.end(), more.begin(), more.end());
    turn();
  }
  EXPECT_LT(lines.size(), static_cast<std::size_t>(kWaves));
  EXPECT_EQ(lines.back()["type"], "cycle");
  EXPECT_EQ(server->client_count(), 1);
}

TEST_F(StreamExtrasTest, RefusesWhatItCannotGive) {
  TestClient client(socket);
  turn();
  for (const char* bad : {R"(["cycle"])", R"("wave")", "[1]", "null", R"([""])"}) {
    const json answer = subscribe(client, bad);
    ASSERT_TRUE(answer.contains("error")) << bad << answer;
    EXPECT_EQ(answer["error"]["code"], -32602);
    EXPECT_THAT(answer["error"]["message"].get<std::string>(), HasSubstr("\"scope\""));
  }
  EXPECT_FALSE(server->wants("wave"));
}

TEST_F(StreamExtrasTest, AListenerMaySubscribeButNotCommand) {
  const auto view = directory / "view.sock";
  auto listener = listen_unix(view, "--view-socket", "no-such-group");
  ASSERT_TRUE(listener) << listener.error().what;
  server->add_listener(std::move(*listener), true);
  TestClient client(view);
  turn();
  EXPECT_TRUE(subscribe(client, R"(["rig"])").contains("result"));
  for (const char* method : {"stop", "estop", "ack", "control.acquire", "diagnose"}) {
    const auto answers =
        ask(client, json{{"jsonrpc", "2.0"}, {"id", 2}, {"method", method}}.dump() + "\n");
    ASSERT_EQ(answers.size(), 1U);
    EXPECT_EQ(answers[0]["error"]["code"], -32004) << method;
  }
  EXPECT_THAT(rig.asked, IsEmpty());
}

}  // namespace
}  // namespace shaker::daemon
