// A client that wants to stop the rig always finds a place.
#include <sys/stat.h>

#include "tests/daemon/publish/server_fixture.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TestClient;
using testing::types;

std::string request(const std::string& method) {
  return R"({"jsonrpc":"2.0","id":1,"method":")" + method + "\"}\n";
}

class StreamPlaces : public testing::StreamServerTest {
 protected:
  TestClient& come() {
    clients.push_back(std::make_unique<TestClient>(socket));
    turn();
    return *clients.back();
  }
  void come(int count) {
    for (int i = 0; i < count; ++i)
      come();
  }
  bool is_here(TestClient& client) {
    const auto answers = ask(client, request("ping"));
    return answers.size() == 1 && answers[0].contains("result");
  }
  // Reads what the server sent before it closed the connection.
  bool was_told_to_go(TestClient& client) {
    turn();
    const auto lines = client.lines();
    return client.closed() && !lines.empty() && lines.back()["error"]["code"] == -32005;
  }

  std::vector<std::unique_ptr<TestClient>> clients;
};

TEST_F(StreamPlaces, AStopIsHeardWhileTwoHundredConnectionsAreHeldAndTwentyListenByTcp) {
  const int port = listen_on_tcp();
  for (int i = 0; i < 20; ++i) {
    clients.push_back(std::make_unique<TestClient>(port));
    turn();
  }
  come(200);
  EXPECT_EQ(server->client_count(), 8 + 16);
  const auto answers = ask(come(), request("stop"));
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_TRUE(answers[0].contains("result")) << answers[0];
  ASSERT_EQ(rig.asked.size(), 1U);
  EXPECT_THAT(rig.asked[0], HasSubstr("stop by "));
}

TEST_F(StreamPlaces, FourteenStayAndTheOldestBeyondThemMakesWayAndIsTold) {
  come(17);
  EXPECT_EQ(server->client_count(), 16);
  EXPECT_TRUE(was_told_to_go(*clients[14]));
  for (std::size_t i : {0U, 13U, 15U, 16U})
    EXPECT_TRUE(is_here(*clients[i])) << i;
}

TEST_F(StreamPlaces, WhoAsksOnlyMakesWayToo) {
  come(14);
  TestClient& asks = come();
  ASSERT_EQ(ask(asks, request("status")).size(), 1U);
  TestClient& is_refused = come();
  ASSERT_EQ(ask(is_refused, request("control.release")).size(), 1U);
  come(2);
  EXPECT_TRUE(was_told_to_go(asks));
  EXPECT_TRUE(was_told_to_go(is_refused));
}

TEST_F(StreamPlaces, WhoHasCommandedKeepsItsPlaceForAWhile) {
  come(14);
  TestClient& stops = come();
  ask(stops, request("stop"));
  TestClient& idle = come();
  come();
  EXPECT_TRUE(was_told_to_go(idle));
  EXPECT_TRUE(is_here(stops));
  clock.advance(11s);
  come(2);
  EXPECT_TRUE(was_told_to_go(stops));
}

TEST_F(StreamPlaces, WhoIsInControlKeepsItsPlace) {
  come(14);
  TestClient& controls = come();
  ask(controls, request("control.acquire"));
  clock.advance(11s);
  come(50);
  EXPECT_TRUE(is_here(controls));
}

TEST_F(StreamPlaces, WhoHasReleasedControlMakesWay) {
  come(14);
  TestClient& controls = come();
  ask(controls, request("control.acquire"));
  ask(controls, request("control.release"));
  clock.advance(11s);
  come(50);
  EXPECT_TRUE(was_told_to_go(controls));
}

TEST_F(StreamPlaces, ACommandThatHasBeenSentIsObeyedBeforeItsSenderMakesWay) {
  come(16);
  clients[14]->send(request("estop"));
  clients.push_back(std::make_unique<TestClient>(socket));
  sd_event_run(loop, 0);  // either of the two may come first
  turn();
  ASSERT_EQ(rig.asked.size(), 1U);
  EXPECT_TRUE(was_told_to_go(*clients[15]));
  EXPECT_EQ(types(clients[14]->lines()), (std::vector<std::string>{"version", "answer"}));
}

TEST_F(StreamPlaces, RefusesANewcomerWhenAllWhoCouldMakeWayHaveCommanded) {
  come(16);
  for (std::size_t i : {14U, 15U})
    ask(*clients[i], request("stop"));
  TestClient& late = come();
  const auto lines = late.lines();
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0]["error"]["code"], -32005);
  EXPECT_THAT(lines[0]["error"]["message"].get<std::string>(), HasSubstr("16 clients"));
  EXPECT_TRUE(late.closed());
}

TEST_F(StreamPlaces, WhoeverIsLongestThereMovesUpWhenAPlaceIsFree) {
  come(16);
  clients[3]->close();
  turn();
  come(2);
  EXPECT_TRUE(is_here(*clients[14]));  // it is now the fourteenth client
  EXPECT_TRUE(was_told_to_go(*clients[15]));
}

TEST_F(StreamPlaces, TcpListenersHaveEightPlacesOfTheirOwn) {
  const int port = listen_on_tcp();
  for (int i = 0; i < 9; ++i) {
    clients.push_back(std::make_unique<TestClient>(port));
    turn();
  }
  EXPECT_EQ(server->client_count(), 8);
  const auto lines = clients.back()->lines();
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0]["error"]["code"], -32005);
  EXPECT_THAT(lines[0]["error"]["message"].get<std::string>(),
              HasSubstr("8 clients that may only listen"));
  EXPECT_TRUE(is_here(come()));
}

}  // namespace
}  // namespace shaker::daemon
