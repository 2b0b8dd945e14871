// A real server on real sockets; the test runs its event loop.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "daemon/publish/listener.hpp"
#include "daemon/publish/stream_server.hpp"
#include "tests/daemon/publish/fake_rig.hpp"

namespace shaker::daemon::testing {

// A client that reads lines. It never blocks for long, because the server runs on the same
// thread.
class TestClient {
 public:
  explicit TestClient(const std::filesystem::path& path)
      : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.string().copy(address.sun_path, sizeof address.sun_path - 1);
    connect(&address, sizeof address);
  }
  explicit TestClient(int port) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connect(&address, sizeof address);
  }
  void send(const std::string& bytes) { EXPECT_EQ(send_some(bytes), bytes.size()); }
  // Returns how many bytes the kernel took; 0 when its buffer is full.
  std::size_t send_some(const std::string& bytes) {
    const ssize_t sent = ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return sent > 0 ? static_cast<std::size_t>(sent) : 0;
  }
  void close() { fd_.reset(); }
  void end_sending() { ::shutdown(fd_.get(), SHUT_WR); }
  bool closed() const { return closed_; }

  // The lines that have arrived, parsed.
  std::vector<nlohmann::json> lines() {
    char buffer[65536];
    while (true) {
      const ssize_t got = ::recv(fd_.get(), buffer, sizeof buffer, MSG_DONTWAIT);
      if (got == 0) closed_ = true;
      if (got <= 0) break;
      text_.append(buffer, static_cast<std::size_t>(got));
    }
    std::vector<nlohmann::json> all;
    for (auto end = text_.find('\n'); end != std::string::npos; end = text_.find('\n')) {
      all.push_back(nlohmann::json::parse(text_.substr(0, end)));
      text_.erase(0, end + 1);
    }
    return all;
  }
  const std::string& rest() const { return text_; }

 private:
  void connect(const void* address, socklen_t size) {
    EXPECT_EQ(::connect(fd_.get(), static_cast<const sockaddr*>(address), size), 0);
  }

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
  // Returns the port that the kernel chose.
  int listen_on_tcp() {
    auto listener = listen_tcp(0);
    if (!listener) {
      ADD_FAILURE() << listener.error().what;
      return 0;
    }
    const int port = bound_port(*listener);
    server->add_listener(std::move(*listener), true);
    return port;
  }
  // Runs the loop until nothing is left to do.
  void turn() {
    while (sd_event_run(loop, 0) > 0) {
    }
  }
  void publish(std::uint64_t seq, const std::string& type, std::size_t padding = 0) {
    const nlohmann::json line = {
        {"type", type}, {"seq", seq}, {"padding", std::string(padding, 'x')}};
    server->publish({seq,
                     type == "state"      ? "state"
                     : type == "estimate" ? "estimate"
                                          : "cycle",
                     line.dump()});
  }
  // Sends, lets the server work, and returns the answers.
  std::vector<nlohmann::json> ask(TestClient& client, const std::string& bytes) {
    client.send(bytes);
    turn();
    auto all = client.lines();
    std::erase_if(all, [](const nlohmann::json& line) { return line.contains("type"); });
    return all;
  }

  std::filesystem::path directory, socket;
  sd_event* loop = nullptr;
  SimulatedClock clock;
  FakeRig rig;
  Commands commands{rig, clock, std::chrono::seconds(2)};
  std::unique_ptr<StreamServer> server;
};

inline std::vector<std::string> types(const std::vector<nlohmann::json>& lines) {
  std::vector<std::string> all;
  for (const nlohmann::json& line : lines)
    all.push_back(line.value("type", "answer"));
  return all;
}

}  // namespace shaker::daemon::testing
