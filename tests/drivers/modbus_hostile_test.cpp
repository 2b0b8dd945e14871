// A hostile server: whatever it sends, the client must not crash, hang, or accept a value that
// was not sent for its request. When the server becomes honest, the client works again. The
// seed is fixed. Run it under the address sanitizer too (SHAKER_SANITIZE).
#include <array>
#include <atomic>
#include <random>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/unique_fd.hpp"
#include "drivers/modbus/connection.hpp"

namespace shaker::drivers::modbus {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint16_t kTruth = 0x5AA5;  // content of each register in an honest answer

class HostileServer {
 public:
  explicit HostileServer(unsigned seed) : random_(seed) {
    listener_ = UniqueFd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    EXPECT_EQ(::bind(listener_.get(), generic, size), 0);
    EXPECT_EQ(::listen(listener_.get(), 8), 0);
    EXPECT_EQ(::getsockname(listener_.get(), generic, &size), 0);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { serve(); });
  }
  HostileServer(const HostileServer&) = delete;
  HostileServer& operator=(const HostileServer&) = delete;
  ~HostileServer() {
    done_ = true;
    thread_.join();
  }
  int port() const { return port_; }
  void turn_honest() { honest_ = true; }

 private:
  bool readable(int fd) const {
    pollfd wait{fd, POLLIN, 0};
    return ::poll(&wait, 1, 5) > 0;
  }

  void serve() {
    while (!done_) {
      if (!readable(listener_.get())) continue;
      const UniqueFd peer(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
      while (!done_ && answer(peer.get())) {
      }
    }
  }

  // Returns false to close the connection.
  bool answer(int fd) {
    if (!readable(fd)) return true;
    std::array<std::uint8_t, 512> request{};
    const auto got = ::recv(fd, request.data(), request.size(), 0);
    if (got < 12) return got > 0;
    Bytes reply = honest_reply(request);
    if (!honest_) {
      const unsigned kind = random_() % 14;
      if (kind == 0) return false;
      spoil(kind, request, reply);
      if (kind == 9) return drip(fd, reply);
    }
    send(fd, reply);
    return true;
  }

  static Bytes honest_reply(const std::array<std::uint8_t, 512>& request) {
    if (request[7] != 3) {
      Bytes echo(request.begin(), request.begin() + 12);
      echo[4] = 0;
      echo[5] = 6;
      return echo;
    }
    const int count = request[10] << 8 | request[11];
    Bytes reply(request.begin(), request.begin() + 8);
    reply[4] = static_cast<std::uint8_t>((3 + 2 * count) >> 8);
    reply[5] = static_cast<std::uint8_t>(3 + 2 * count);
    reply.push_back(static_cast<std::uint8_t>(2 * count));
    for (int i = 0; i < count; ++i) {
      reply.push_back(kTruth >> 8);
      reply.push_back(kTruth & 0xFF);
    }
    return reply;
  }

  void spoil(unsigned kind, const std::array<std::uint8_t, 512>& request, Bytes& reply) {
    const auto byte = [&] { return static_cast<std::uint8_t>(random_()); };
    switch (kind) {
      case 1:  // random bytes of any length
        reply.resize(random_() % 2000);
        for (auto& b : reply)
          b = byte();
        break;
      case 2:  // truncated
        reply.resize(random_() % reply.size());
        break;
      case 3:  // the answer to another request
        reply[0] ^= static_cast<std::uint8_t>(1 + random_() % 255);
        for (std::size_t i = 9; i < reply.size(); ++i)
          reply[i] = byte();
        break;
      case 4:  // a wrong length field
        reply[4] = byte();
        reply[5] = byte();
        break;
      case 5:  // a wrong byte count
        if (reply.size() > 8) reply[8] = byte();
        break;
      case 6:  // far too long
        reply.resize(reply.size() + 70000, 0xEE);
        break;
      case 7:  // an exception, known or unknown
        reply.assign(request.begin(), request.begin() + 9);
        reply[4] = 0;
        reply[5] = 3;
        reply[7] |= 0x80;
        reply[8] = byte();
        break;
      case 8:  // another function
        reply[7] = byte();
        break;
      case 10:  // silence
        reply.clear();
        break;
      case 11:  // twice the answer
        reply.insert(reply.end(), reply.begin(), reply.end());
        break;
      case 12: {  // an empty answer that claims to be complete
        reply.resize(9);
        break;
      }
      default:
        break;  // 9 sends slowly, 13 is honest
    }
  }

  // Sends more slowly than the response timeout and closes the connection half-way.
  bool drip(int fd, const Bytes& reply) {
    for (const std::uint8_t b : Bytes(reply.begin(), reply.begin() + 11)) {
      if (done_ || ::send(fd, &b, 1, MSG_NOSIGNAL) != 1) return false;
      std::this_thread::sleep_for(4ms);
    }
    return false;
  }

  void send(int fd, const Bytes& reply) {
    std::size_t sent = 0;
    while (sent < reply.size() && !done_) {
      const auto now =
          ::send(fd, reply.data() + sent, reply.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (now <= 0) return;  // the client may stop reading
      sent += static_cast<std::size_t>(now);
    }
  }

  std::mt19937 random_;
  UniqueFd listener_;
  int port_ = 0;
  std::atomic<bool> done_{false}, honest_{false};
  std::thread thread_;
};

TEST(HostileModbusServer, NeitherCrashesNorHangsNorFoolsTheClient) {
  HostileServer server(20260301);
  RealClock clock;
  config::ModbusLink link;
  link.transport = config::ModbusTcp{"127.0.0.1", server.port()};
  link.response_timeout_s = 0.02;
  link.reconnect_s = 0.001;
  auto made = ModbusConnection::make(link, clock);
  ASSERT_TRUE(made);
  ModbusConnection& connection = **made;

  std::mt19937 random(7);
  int good = 0, bad = 0;
  Nanoseconds longest{0};
  const Nanoseconds latest = clock.now() + 60s;
  while (good + bad < 400 && clock.now() < latest) {
    if (!connection.connected() && !connection.connect()) {
      clock.sleep_until(clock.now() + 1ms);
      continue;
    }
    const Nanoseconds before = clock.now();
    bool done = false;
    if (random() % 4 == 0) {
      done = connection.write(7, std::array<std::uint16_t, 2>{1, 2}).ok();
    } else {
      const int count = 1 + static_cast<int>(random() % 125);
      std::vector<std::uint16_t> words(static_cast<std::size_t>(count));
      done = connection.read({protocol::modbus::RegisterTable::holding, 0, count}, words).ok();
      if (done) {
        EXPECT_THAT(words, testing::Each(kTruth));
      }
    }
    longest = std::max(longest, clock.now() - before);
    ++(done ? good : bad);
  }
  EXPECT_GE(good + bad, 200);
  EXPECT_GT(good, 30);
  EXPECT_GT(bad, 100);
  EXPECT_LT(longest, 2s) << "20 ms on a free machine";

  RecordProperty("longest_call_us", static_cast<int>(longest / 1us));

  server.turn_honest();
  int in_a_row = 0;
  while (in_a_row < 20 && clock.now() < latest + 20s) {
    std::array<std::uint16_t, 3> words{};
    (void)connection.connect();
    const bool done = connection.read({protocol::modbus::RegisterTable::holding, 0, 3}, words).ok();
    in_a_row = done && words[2] == kTruth ? in_a_row + 1 : 0;
  }
  EXPECT_EQ(in_a_row, 20);
}

}  // namespace
}  // namespace shaker::drivers::modbus
