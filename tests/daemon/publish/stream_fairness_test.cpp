// However much a client sends, the other clients are served, and memory stays bounded.
#include "tests/daemon/publish/server_fixture.hpp"

namespace shaker::daemon {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;
using testing::TestClient;

std::string requests(const std::string& method, int count) {
  std::string all;
  for (int id = 1; id <= count; ++id)
    all += R"({"jsonrpc":"2.0","id":)" + std::to_string(id) + R"(,"method":")" + method + "\"}\n";
  return all;
}

class StreamFairness : public testing::StreamServerTest {
 protected:
  // Handles one event source of the loop.
  bool one_turn() { return sd_event_run(loop, 0) > 0; }
};

TEST_F(StreamFairness, AStopWaitsForAFewRequestsOfEachOtherClientAtMost) {
  std::vector<std::unique_ptr<TestClient>> flood;
  for (int i = 0; i < 13; ++i)
    flood.push_back(std::make_unique<TestClient>(socket));
  TestClient stops(socket);
  turn();
  for (auto& client : flood)
    client->send(requests("ack", 200));  // the rig records how many requests it got
  for (int i = 0; i < 5; ++i)
    ASSERT_TRUE(one_turn());
  stops.send(requests("stop", 1));
  const auto before = rig.asked.size();
  while (rig.asked.empty() || rig.asked.back().rfind("stop", 0) != 0)
    ASSERT_TRUE(one_turn());
  EXPECT_LE(rig.asked.size() - before, 2U * 13U * 4U + 1U);
  turn();
  EXPECT_EQ(rig.asked.size(), 13U * 200U + 1U);  // nothing is lost
}

TEST_F(StreamFairness, ReadsAFewKibibytesInATurn) {
  TestClient client(socket);
  turn();
  const std::string line =
      R"({"jsonrpc":"2.0","method":"stop","params":[")" + std::string(60'000, 'x') + "\"]}\n";
  client.send(line);
  int turns = 0;
  while (rig.asked.empty()) {
    ASSERT_TRUE(one_turn());
    ++turns;
  }
  EXPECT_GE(turns, 60'000 / 4096);
}

TEST_F(StreamFairness, DoesNotReadFromAClientThatDoesNotReadItsAnswers) {
  TestClient client(socket);
  turn();
  const std::string some = requests("nonsense", 100);
  std::string pending;
  std::size_t whole = 0, rounds = 0;
  for (std::size_t sent = 1; sent != 0 && rounds < 1000; ++rounds) {
    if (pending.empty()) {
      pending = some;
      whole += 100;
    }
    sent = client.send_some(pending);
    pending.erase(0, sent);
    turn();
  }
  EXPECT_LT(rounds, 1000U);  // its own buffer is full, so it waits
  EXPECT_EQ(server->client_count(), 1);
  // When it reads again, it is served and no answer is missing.
  std::size_t answers = 0;
  std::vector<nlohmann::json> lines;
  for (int i = 0; i < 10'000 && answers < whole; ++i) {
    pending.erase(0, client.send_some(pending));
    turn();
    for (const auto& line : client.lines())
      answers += line.contains("error") ? 1 : 0;
  }
  EXPECT_EQ(answers, whole);
}

TEST_F(StreamFairness, DocumentsThatAreNotReadDoNotKeepAStopFromBeingRead) {
  TestClient client(socket);
  turn();
  for (std::uint64_t seq = 1; seq <= 600; ++seq)
    publish(seq, "cycle", 2000);
  client.send(requests("stop", 1));
  turn();
  ASSERT_EQ(rig.asked.size(), 1U);
}

TEST_F(StreamFairness, ObeysAllThatAClientHasSentBeforeItWent) {
  {
    TestClient client(socket);
    turn();
    client.send(requests("ack", 100) + requests("estop", 1));
  }
  turn();
  ASSERT_EQ(rig.asked.size(), 101U);
  EXPECT_THAT(rig.asked.back(), HasSubstr("estop"));
  EXPECT_EQ(server->client_count(), 0);
}

}  // namespace
}  // namespace shaker::daemon
