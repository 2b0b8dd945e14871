// A real server on real sockets; the test runs its event loop.
#include "daemon/publish/stream_server.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include "tests/daemon/publish/server_fixture.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::StreamServerTest;
using testing::TestClient;
using testing::types;

TEST_F(StreamServerTest, GivesALateJoinerVersionThenSnapshotThenEverything) {
  publish(1, "state");
  publish(2, "cycle");
  publish(3, "estimate");
  publish(4, "state");
  publish(5, "cycle");
  TestClient client(socket);
  turn();
  publish(6, "cycle");
  turn();
  const auto lines = client.lines();
  ASSERT_THAT(types(lines), ElementsAre("version", "state", "estimate", "cycle"));
  EXPECT_EQ(lines[0]["seq"], 5);  // the next document has the next number
  EXPECT_EQ(lines[0]["rig"], "rig A");
  EXPECT_EQ(lines[1]["seq"], 4);
  EXPECT_EQ(lines[2]["seq"], 3);
  EXPECT_EQ(lines[3]["seq"], 6);
}

TEST_F(StreamServerTest, TellsEveryLateJoinerTheAlarmsThatNobodyHasAcknowledged) {
  const auto alarm = [&](std::uint64_t seq, const char* severity, const char* code) {
    const json line = {{"type", "alarm"}, {"seq", seq}, {"severity", severity}, {"code", code}};
    server->publish({seq, "alarm", line.dump()});
  };
  alarm(1, "warning", "campaign_interrupted");
  alarm(2, "info", "at_rest");
  publish(3, "state");
  for (int i = 0; i < 2; ++i) {
    TestClient client(socket);
    turn();
    const auto lines = client.lines();
    EXPECT_THAT(types(lines), ElementsAre("version", "state", "alarm"));
    EXPECT_EQ(lines.back()["seq"], 1);
  }
  alarm(4, "info", "acknowledged");
  TestClient client(socket);
  turn();
  EXPECT_THAT(types(client.lines()), ElementsAre("version", "state"));
}

TEST_F(StreamServerTest, ForgetsTheEstimateOfTheCampaignBefore) {
  publish(1, "estimate");
  for (const auto& [index, expected] : {std::pair{1, 2U}, std::pair{0, 1U}}) {
    const json line = {{"type", "run_start"}, {"seq", 2}, {"run_index", index}};
    server->publish({2, "run_start", line.dump()});
    TestClient client(socket);
    turn();
    EXPECT_EQ(client.lines().size(), expected) << "run " << index;
  }
}

TEST_F(StreamServerTest, MakesTheSocketForUserAndGroupOnly) {
  struct stat status {};
  ASSERT_EQ(::stat(socket.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0660U);
}

TEST_F(StreamServerTest, RefusesASocketThatALivingDaemonHasAndReplacesADeadOnes) {
  const auto second = listen_unix(socket);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().what, HasSubstr("another shakerd answers there"));
  server.reset();  // the socket file stays, as after a killed daemon
  EXPECT_TRUE(std::filesystem::exists(socket));
  EXPECT_TRUE(listen_unix(socket));
}

TEST_F(StreamServerTest, AnswersRequestsInPiecesAndSeveralAtOnce) {
  TestClient client(socket);
  turn();
  EXPECT_TRUE(ask(client, R"({"jsonrpc":"2.0","id":1,)").empty());
  const auto answers = ask(
      client, "\"method\":\"ping\"}\n{\"jsonrpc\":\"2.0\",\"id\":\"b\",\"method\":\"status\"}\n");
  ASSERT_EQ(answers.size(), 2U);
  EXPECT_EQ(answers[0]["id"], 1);
  EXPECT_EQ(answers[0]["result"], json::object());
  EXPECT_EQ(answers[1]["id"], "b");
  EXPECT_EQ(answers[1]["result"]["state"]["state"], "IDLE");
}

TEST_F(StreamServerTest, NeverAnswersANotification) {
  TestClient client(socket);
  turn();
  EXPECT_TRUE(ask(client, "{\"jsonrpc\":\"2.0\",\"method\":\"stop\"}\n").empty());
  ASSERT_EQ(rig.asked.size(), 1U);
  EXPECT_THAT(rig.asked[0], HasSubstr(std::to_string(::getpid())));  // SO_PEERCRED
  EXPECT_TRUE(ask(client, "{\"jsonrpc\":\"2.0\",\"method\":\"no such\"}\n").empty());
}

TEST_F(StreamServerTest, ThrowsALineThatIsTooLongAwayOnceAndGoesOn) {
  TestClient client(socket);
  turn();
  std::vector<json> answers;
  for (int i = 0; i < 20; ++i) {
    for (auto& line : ask(client, std::string(10'000, 'a')))
      answers.push_back(line);
  }
  for (auto& line : ask(client, "\n{\"jsonrpc\":\"2.0\",\"id\":2,\"method\":\"ping\"}\n")) {
    answers.push_back(line);
  }
  ASSERT_EQ(answers.size(), 2U);
  EXPECT_EQ(answers[0]["error"]["code"], -32003);
  EXPECT_EQ(answers[1]["id"], 2);
}

TEST_F(StreamServerTest, TellsASlowClientHowMuchItMissedThenDropsIt) {
  restart({.max_queued = 100'000});
  TestClient slow(socket), quick(socket);
  turn();
  std::uint64_t quick_lines = 0, seq = 0;
  for (; seq < 600;) {
    publish(++seq, "cycle", 2000);
    turn();
    quick_lines += quick.lines().size();
  }
  EXPECT_EQ(quick_lines, seq + 1);  // including the version
  std::vector<json> got;
  for (int i = 0; i < 100 && !slow.closed(); ++i) {
    for (auto& line : slow.lines())
      got.push_back(line);
    turn();
  }
  EXPECT_TRUE(slow.closed());
  EXPECT_TRUE(slow.rest().empty());  // no line is cut
  ASSERT_EQ(got.back()["type"], "missed");
  EXPECT_GT(got.back()["count"], 100);
  const auto last_seen = got[got.size() - 2]["seq"].get<std::uint64_t>();
  EXPECT_EQ(last_seen + got.back()["count"].get<std::uint64_t>(), seq);
  EXPECT_EQ(server->client_count(), 1);
}

TEST_F(StreamServerTest, ClosesASlowClientThatDoesNotEvenReadWhatItMissed) {
  restart({.max_queued = 100'000});
  TestClient slow(socket);
  turn();
  for (std::uint64_t seq = 1; seq < 600; ++seq)
    publish(seq, "cycle", 2000);
  turn();
  server->tick();
  EXPECT_EQ(server->client_count(), 1);
  clock.advance(6s);
  server->tick();
  EXPECT_EQ(server->client_count(), 0);
}

TEST_F(StreamServerTest, NoticesWhenTheControllingClientGoes) {
  TestClient client(socket);
  turn();
  ask(client, "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"control.acquire\"}\n");
  EXPECT_TRUE(rig.controlled);
  client.close();
  turn();
  EXPECT_THAT(rig.asked, ElementsAre("lease lost"));
  EXPECT_EQ(server->client_count(), 0);
}

TEST_F(StreamServerTest, GoesOnSendingToAClientThatHasSaidAllItHadToSay) {
  TestClient client(socket);
  turn();
  client.send("{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"ping\"}\n");
  client.end_sending();
  turn();
  publish(1, "cycle");
  turn();
  EXPECT_THAT(types(client.lines()), ElementsAre("version", "answer", "cycle"));
  EXPECT_EQ(server->client_count(), 1);
  client.close();
  turn();
  publish(2, "cycle");
  turn();
  EXPECT_EQ(server->client_count(), 0);
}

TEST_F(StreamServerTest, LetsATcpClientListenOnly) {
  TestClient client(listen_on_tcp());
  const auto answers = ask(client, "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"stop\"}\n");
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0]["error"]["code"], -32004);
  EXPECT_TRUE(rig.asked.empty());
}

}  // namespace
}  // namespace shaker::daemon
