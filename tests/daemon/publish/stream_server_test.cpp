// A real server on real sockets, its loop turned by the test.
#include "daemon/publish/stream_server.hpp"

#include <filesystem>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "daemon/publish/commands.hpp"
#include "daemon/publish/listener.hpp"
#include "tests/daemon/publish/fake_rig.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The other end, reading lines. Never blocks for long: the server is on the same thread.
class TestClient {
 public:
  explicit TestClient(const std::filesystem::path& path)
      : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.string().copy(address.sun_path, sizeof address.sun_path - 1);
    const void* generic = &address;
    EXPECT_EQ(::connect(fd_.get(), static_cast<const sockaddr*>(generic), sizeof address), 0);
  }
  void send(const std::string& bytes) {
    EXPECT_EQ(::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  void close() { fd_.reset(); }
  void end_sending() { ::shutdown(fd_.get(), SHUT_WR); }
  bool closed() const { return closed_; }

  // What has come, parsed.
  std::vector<json> lines() {
    char buffer[65536];
    while (true) {
      const ssize_t got = ::recv(fd_.get(), buffer, sizeof buffer, MSG_DONTWAIT);
      if (got == 0) closed_ = true;
      if (got <= 0) break;
      text_.append(buffer, static_cast<std::size_t>(got));
    }
    std::vector<json> all;
    for (auto end = text_.find('\n'); end != std::string::npos; end = text_.find('\n')) {
      all.push_back(json::parse(text_.substr(0, end)));
      text_.erase(0, end + 1);
    }
    return all;
  }
  const std::string& rest() const { return text_; }

 private:
  UniqueFd fd_;
  std::string text_;
  bool closed_ = false;
};

class StreamServerTest : public ::testing::Test {
 protected:
  StreamServerTest() {
    std::string pattern = (std::filesystem::temp_directory_path() / "server.XXXXXX").string();
    directory = ::mkdtemp(pattern.data());
    socket = directory / "s.sock";
    sd_event_new(&loop);
    restart({});
  }
  ~StreamServerTest() override {
    server.reset();
    sd_event_unref(loop);
    std::filesystem::remove_all(directory);
  }

  void restart(ServerOptions options) {
    server.reset();
    server = std::make_unique<StreamServer>(
        loop, clock, commands, protocol::VersionDocument{"shakerd", "9", 1, "rig A"}, options);
    auto listener = listen_unix(socket);
    ASSERT_TRUE(listener) << listener.error().what;
    server->add_listener(std::move(*listener), false);
  }
  // Until nothing is left to do.
  void turn() {
    while (sd_event_run(loop, 0) > 0) {
    }
  }
  void publish(std::uint64_t seq, const std::string& type, std::size_t padding = 0) {
    const json line = {{"type", type}, {"seq", seq}, {"padding", std::string(padding, 'x')}};
    server->publish({seq,
                     type == "state"      ? "state"
                     : type == "estimate" ? "estimate"
                                          : "cycle",
                     line.dump()});
  }
  // Sends, lets the server work, and gives the answers.
  std::vector<json> ask(TestClient& client, const std::string& bytes) {
    client.send(bytes);
    turn();
    auto all = client.lines();
    std::erase_if(all, [](const json& line) { return line.contains("type"); });
    return all;
  }

  std::filesystem::path directory, socket;
  sd_event* loop = nullptr;
  SimulatedClock clock;
  testing::FakeRig rig;
  Commands commands{rig, clock, 2s};
  std::unique_ptr<StreamServer> server;
};

std::vector<std::string> types(const std::vector<json>& lines) {
  std::vector<std::string> all;
  for (const json& line : lines)
    all.push_back(line.value("type", "answer"));
  return all;
}

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
  EXPECT_EQ(lines[0]["seq"], 5);  // the next document follows it
  EXPECT_EQ(lines[0]["rig"], "rig A");
  EXPECT_EQ(lines[1]["seq"], 4);
  EXPECT_EQ(lines[2]["seq"], 3);
  EXPECT_EQ(lines[3]["seq"], 6);
}

TEST_F(StreamServerTest, TellsEveryLateJoinerWhatWasFoundAtTheStart) {
  const PublishedLine found{1, "alarm", R"({"type":"alarm","seq":1})"};
  server->keep_for_late_joiners(found);
  server->publish(found);
  publish(2, "state");
  for (int i = 0; i < 2; ++i) {
    TestClient client(socket);
    turn();
    EXPECT_THAT(types(client.lines()), ElementsAre("version", "state", "alarm"));
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
  server.reset();  // leaves the file behind, as a killed daemon does
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
  restart({16, 100'000, 5s});
  TestClient slow(socket), quick(socket);
  turn();
  std::uint64_t quick_lines = 0, seq = 0;
  for (; seq < 600;) {
    publish(++seq, "cycle", 2000);
    turn();
    quick_lines += quick.lines().size();
  }
  EXPECT_EQ(quick_lines, seq + 1);  // with the version
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
  restart({16, 100'000, 5s});
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

TEST_F(StreamServerTest, TakesSixteenClientsAndTellsTheNextOne) {
  std::vector<std::unique_ptr<TestClient>> clients;
  for (int i = 0; i < 17; ++i) {
    clients.push_back(std::make_unique<TestClient>(socket));
    turn();
  }
  EXPECT_EQ(server->client_count(), 16);
  const auto refused = clients.back()->lines();
  ASSERT_EQ(refused.size(), 1U);
  EXPECT_EQ(refused[0]["error"]["code"], -32005);
  EXPECT_TRUE(clients.back()->closed());
  clients.front()->close();
  turn();
  TestClient again(socket);
  turn();
  EXPECT_EQ(types(again.lines()), std::vector<std::string>{"version"});
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
  auto listener = listen_tcp(0);
  ASSERT_TRUE(listener) << listener.error().what;
  const int port = bound_port(*listener);
  server->add_listener(std::move(*listener), true);
  const UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const void* generic = &address;
  ASSERT_EQ(::connect(fd.get(), static_cast<const sockaddr*>(generic), sizeof address), 0);
  const std::string request = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"stop\"}\n";
  ASSERT_GT(::send(fd.get(), request.data(), request.size(), 0), 0);
  turn();
  char buffer[4096];
  const ssize_t got = ::recv(fd.get(), buffer, sizeof buffer, MSG_DONTWAIT);
  ASSERT_GT(got, 0);
  const std::string text(buffer, static_cast<std::size_t>(got));
  EXPECT_THAT(text, HasSubstr("\"type\":\"version\""));
  EXPECT_THAT(text, HasSubstr("-32004"));
  EXPECT_TRUE(rig.asked.empty());
}

}  // namespace
}  // namespace shaker::daemon
