// The connection against python3-pymodbus, over TCP and over RTU on a pseudo terminal.
#include <array>
#include <numeric>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/unique_fd.hpp"
#include "drivers/modbus/connection.hpp"
#include "modbus_server.hpp"
#include "protocol/modbus/exception.hpp"

namespace shaker::drivers::modbus {
namespace {

using namespace std::chrono_literals;
using protocol::modbus::Block;
using protocol::modbus::RegisterTable;
using testing::ElementsAre;
using testing::HasSubstr;
using Wire = ModbusServer::Wire;
using Words = std::vector<std::uint16_t>;

std::unique_ptr<ModbusConnection> make(const config::ModbusLink& link, Clock& clock) {
  auto made = ModbusConnection::make(link, clock);
  EXPECT_TRUE(made) << (made ? "" : made.error().what);
  return std::move(*made);
}

Result<Words> read(ModbusConnection& connection, int address, int count) {
  Words words(static_cast<std::size_t>(count));
  const Result<void> done = connection.read({RegisterTable::holding, address, count}, words);
  if (!done) return done.error();
  return words;
}

void connect_in_time(ModbusConnection& connection, Clock& clock) {
  const Nanoseconds latest = clock.now() + 20s;
  while (!connection.connect() && clock.now() < latest)
    clock.sleep_until(clock.now() + 5ms);
  ASSERT_TRUE(connection.connected());
}

class ModbusWire : public testing::TestWithParam<Wire> {
 protected:
  ModbusServer server_{GetParam()};
  RealClock clock_;
};

INSTANTIATE_TEST_SUITE_P(Modbus, ModbusWire, testing::Values(Wire::tcp, Wire::rtu),
                         [](const auto& wire) { return wire.param == Wire::tcp ? "Tcp" : "Rtu"; });

TEST_P(ModbusWire, CarriesRegistersBothWays) {
  server_.order("set 10 0001 FFFF 1234");
  server_.order("input 10 4321");
  auto connection = make(server_.link(), clock_);
  ASSERT_TRUE(connection->connect());
  EXPECT_THAT(*read(*connection, 10, 3), ElementsAre(1, 0xFFFF, 0x1234));
  Words input(1);
  ASSERT_TRUE(connection->read({RegisterTable::input, 10, 1}, input));
  EXPECT_EQ(input[0], 0x4321);
  ASSERT_TRUE(connection->write(20, Words{0xBEEF}));
  ASSERT_TRUE(connection->write(21, Words{1, 2, 3}));
  EXPECT_EQ(server_.order("get 20 4"), "BEEF 0001 0002 0003");
  EXPECT_EQ(server_.order("log"), "6:20=BEEF 16:21=0001,0002,0003");
}

TEST_P(ModbusWire, TakesTheLargestBlocks) {
  auto connection = make(server_.link(), clock_);
  ASSERT_TRUE(connection->connect());
  Words sent(protocol::modbus::kMaxWriteWords);
  std::iota(sent.begin(), sent.end(), std::uint16_t{500});
  ASSERT_TRUE(connection->write(0, sent));
  const Result<Words> got = read(*connection, 0, protocol::modbus::kMaxReadWords);
  ASSERT_TRUE(got) << got.error().what;
  EXPECT_TRUE(std::equal(sent.begin(), sent.end(), got->begin()));
}

// The transaction number has two bytes and wraps after 65536.
TEST_P(ModbusWire, NumbersMoreThan256Transactions) {
  server_.order("set 10 1234");
  auto connection = make(server_.link(), clock_);
  ASSERT_TRUE(connection->connect());
  for (int i = 0; i < 300; ++i)
    ASSERT_TRUE(read(*connection, 10, 1)) << i;
}

TEST_P(ModbusWire, GivesEveryExceptionItsSentence) {
  config::ModbusLink link = server_.link();
  link.response_timeout_s = 20.0;
  auto connection = make(link, clock_);
  ASSERT_TRUE(connection->connect());
  for (const int code : {0x01, 0x02, 0x03, 0x04, 0x06, 0x07, 0x08, 0x09, 0x0A, 0x0B}) {
    server_.order(fmt::format("exception {} 1000000", code));
    const Result<Words> got = read(*connection, 0, 2);
    ASSERT_FALSE(got) << code;
    EXPECT_EQ(got.error().kind, ErrorKind::refused);
    EXPECT_THAT(got.error().what, HasSubstr(protocol::modbus::exception_sentence(code)));
    EXPECT_THAT(got.error().what, HasSubstr("reading holding registers 0..1"));
  }
  EXPECT_TRUE(connection->connected()) << "a device that says no is alive";
}

TEST_P(ModbusWire, RetriesWhenBusyAndTakesAcknowledgeForYes) {
  server_.order("set 3 0007");
  auto connection = make(server_.link(), clock_);
  ASSERT_TRUE(connection->connect());
  server_.order("exception 6 3");
  EXPECT_THAT(*read(*connection, 3, 1), ElementsAre(7));
  server_.order("exception 6 2");
  EXPECT_TRUE(connection->write(3, Words{8}));
  EXPECT_EQ(server_.order("get 3"), "0008");
  server_.order("exception 5 1");
  EXPECT_TRUE(connection->write(3, Words{9}));
  EXPECT_EQ(server_.order("get 3"), "0009");
  server_.order("exception 5 1");
  EXPECT_THAT(*read(*connection, 3, 1), ElementsAre(9));
}

TEST_P(ModbusWire, WritesOneRegisterWithFunction16WhereO6IsUnknown) {
  auto connection = make(server_.link(), clock_);
  ASSERT_TRUE(connection->connect());
  server_.order("exception_on 6 1");
  ASSERT_TRUE(connection->write(5, Words{1}));
  ASSERT_TRUE(connection->write(5, Words{2}));
  EXPECT_EQ(server_.order("log"), "16:5=0001 16:5=0002");
}

// libmodbus alone would give every later request the answer of the request before it.
TEST_P(ModbusWire, IsNotPutOutOfStepByALateAnswer) {
  server_.order("set 0 0A0A 0B0B 0C0C");
  config::ModbusLink link = server_.link();
  link.response_timeout_s = 0.3;
  link.timeouts_before_close = 100;
  auto connection = make(link, clock_);
  ASSERT_TRUE(connection->connect());
  for (const int delay : {310, 400, 480}) {
    server_.order(fmt::format("delay {} 1", delay));
    const Result<Words> first = read(*connection, 0, 1);
    EXPECT_TRUE(delay < 350 || !first) << "10 ms late may be in time on a busy machine";
    const Nanoseconds latest = clock_.now() + 10s;
    int right = 0;
    while (right < 6 && clock_.now() < latest) {
      const int address = 1 + right % 2;
      const Result<Words> got = read(*connection, address, 1);
      if (!got) {
        clock_.sleep_until(clock_.now() + 1ms);
        continue;
      }
      ASSERT_EQ((*got)[0], address == 1 ? 0x0B0B : 0x0C0C) << "another request's answer";
      ++right;
    }
    EXPECT_EQ(right, 6);
  }
}

TEST_P(ModbusWire, SaysThatASpoiltAnswerMakesNoSense) {
  server_.order("set 0 0042");
  config::ModbusLink link = server_.link();
  link.response_timeout_s = 0.3;
  auto connection = make(link, clock_);
  ASSERT_TRUE(connection->connect());
  server_.order("garble 1");
  const Result<Words> got = read(*connection, 0, 1);
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().kind, ErrorKind::io) << got.error().what;
  EXPECT_EQ(connection->counters().malformed, 1U);
  connection->wait_for_silence();
  EXPECT_THAT(*read(*connection, 0, 1), ElementsAre(0x42));
}

TEST_P(ModbusWire, BelievesNoOtherUnit) {
  server_.order("set 0 0042");
  config::ModbusLink link = server_.link();
  link.response_timeout_s = 0.3;
  link.timeouts_before_close = 100;
  auto connection = make(link, clock_);
  ASSERT_TRUE(connection->connect());
  const int unit = GetParam() == Wire::tcp ? 0 : 2;
  server_.order(fmt::format("unit {} 3", unit));
  const auto expect_refused = [&](const Result<void>& done) {
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().kind, ErrorKind::io) << done.error().what;
    if (GetParam() == Wire::tcp) {
      EXPECT_THAT(done.error().what, HasSubstr("unit 0 has answered instead of unit 1"));
    }
    connection->wait_for_silence();
  };
  Words word(1);
  expect_refused(connection->read({RegisterTable::holding, 0, 1}, word));
  if (GetParam() == Wire::tcp) {
    EXPECT_EQ(word[0], 0) << "nothing of the answer is used";
  }
  expect_refused(connection->write(5, Words{1}));
  expect_refused(connection->write(5, Words{1, 2}));
  EXPECT_THAT(*read(*connection, 0, 1), ElementsAre(0x42));
}

TEST_P(ModbusWire, BelievesNoNoise) {
  server_.order("set 0 0042");
  config::ModbusLink link = server_.link();
  link.response_timeout_s = 0.02;
  link.timeouts_before_close = 1000;  // so that there is no back-off
  auto connection = make(link, clock_);
  server_.order("noise 60");
  Nanoseconds longest{0};
  for (int i = 0; i < 60; ++i) {
    connect_in_time(*connection, clock_);
    connection->wait_for_silence();
    const Nanoseconds before = clock_.now();
    EXPECT_FALSE(read(*connection, 0, 1 + i % 4));
    longest = std::max(longest, clock_.now() - before);
  }
  EXPECT_LT(longest, 2s) << "20 ms on a free machine";
  server_.order("noise 0");
  const Nanoseconds latest = clock_.now() + 20s;
  Result<Words> got = Error{};
  while (!got && clock_.now() < latest) {
    (void)connection->connect();
    connection->wait_for_silence();
    got = read(*connection, 0, 1);
  }
  ASSERT_TRUE(got) << got.error().what;
  EXPECT_THAT(*got, ElementsAre(0x42));
}

TEST_P(ModbusWire, ClosesAfterSomeTimeoutsInARowAndNotBefore) {
  config::ModbusLink link = server_.link();
  link.response_timeout_s = 0.1;
  link.timeouts_before_close = 3;
  link.reconnect_s = 0.05;
  auto connection = make(link, clock_);
  ASSERT_TRUE(connection->connect());
  server_.order("mute 3");
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(connection->connected());
    connection->wait_for_silence();
    const Nanoseconds before = clock_.now();
    EXPECT_EQ(read(*connection, 0, 1).error().kind, ErrorKind::timeout);
    EXPECT_GE(clock_.now() - before, 95ms);
  }
  EXPECT_FALSE(connection->connected());
  EXPECT_EQ(read(*connection, 0, 1).error().kind, ErrorKind::unavailable);
  connect_in_time(*connection, clock_);
  EXPECT_TRUE(read(*connection, 0, 1));
}

TEST_P(ModbusWire, RecoversTwiceInARowFromAServerThatWasKilled) {
  config::ModbusLink link = server_.link();
  auto connection = make(link, clock_);
  ASSERT_TRUE(connection->connect());
  for (int round = 0; round < 2; ++round) {
    server_.kill();
    const Nanoseconds latest = clock_.now() + 20s;
    while (connection->connected() && clock_.now() < latest)
      (void)read(*connection, 0, 1);
    ASSERT_FALSE(connection->connected());
    server_.restart();
    server_.order("set 0 00AB");
    if (GetParam() == Wire::rtu) {
      connection = make(server_.link(), clock_);  // a pty does not return under its name
    }
    connect_in_time(*connection, clock_);
    EXPECT_THAT(*read(*connection, 0, 1), ElementsAre(0xAB));
  }
  EXPECT_EQ(connection->counters().connects, GetParam() == Wire::tcp ? 3U : 1U);
}

TEST_P(ModbusWire, RefusesADescriptorThatWouldAbortLibmodbus) {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  if (limit.rlim_max < 1100) GTEST_SKIP() << "only " << limit.rlim_max << " files may be open";
  limit.rlim_cur = 1100;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0);
  auto connection = make(server_.link(), clock_);
  std::vector<UniqueFd> taken;
  do {
    taken.emplace_back(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  } while (taken.back().get() < 1030);
  const Result<void> connected = connection->connect();
  ASSERT_FALSE(connected);
  EXPECT_EQ(connected.error().kind, ErrorKind::exhausted) << connected.error().what;
  taken.clear();
  connect_in_time(*connection, clock_);
}

TEST(ModbusRtu, LetsOnlyOneMasterUseALine) {
  ModbusServer server(Wire::rtu);
  RealClock clock;
  auto first = make(server.link(), clock), second = make(server.link(), clock);
  ASSERT_TRUE(first->connect());
  const Result<void> refused = second->connect();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("is in use by another program or device"));
  first->close();
  connect_in_time(*second, clock);
}

// Listens but never answers; its destructor frees the port.
struct SilentListener {
  SilentListener() : fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    EXPECT_EQ(::bind(fd.get(), generic, size), 0);
    EXPECT_EQ(::listen(fd.get(), 8), 0);
    EXPECT_EQ(::getsockname(fd.get(), generic, &size), 0);
    port = ntohs(address.sin_port);
  }
  config::ModbusLink link() const {
    config::ModbusLink link;
    link.transport = config::ModbusTcp{"127.0.0.1", port};
    return link;
  }
  UniqueFd fd;
  int port = 0;
};

TEST(ModbusBackOff, DoublesUpToThirtySecondsAndAnswersAtOnceMeanwhile) {
  config::ModbusLink link;
  {
    SilentListener listener;
    link = listener.link();
  }
  SimulatedClock clock;
  auto connection = make(link, clock);
  for (const double pause : {1.0, 2.0, 4.0, 8.0, 16.0, 30.0, 30.0}) {
    EXPECT_THAT(connection->connect().error().what, HasSubstr("no connection"));
    EXPECT_THAT(connection->connect().error().what,
                HasSubstr(fmt::format("next attempt in {:.1f} s", pause)));
    clock.advance(from_seconds(pause));
  }
}

TEST(ModbusBackOff, DoesNotHoldBackAStop) {
  SilentListener listener;
  config::ModbusLink link = listener.link();
  const int port = std::exchange(std::get<config::ModbusTcp>(link.transport).port, 1);
  SimulatedClock clock;
  EXPECT_FALSE(make(link, clock)->connect());
  std::get<config::ModbusTcp>(link.transport).port = port;
  link.timeouts_before_close = 1;
  link.response_timeout_s = 0.01;
  auto connection = make(link, clock);
  ASSERT_TRUE(connection->connect());
  EXPECT_FALSE(read(*connection, 0, 1));
  EXPECT_THAT(connection->connect().error().what, HasSubstr("next attempt in 1.0 s"));
  EXPECT_TRUE(connection->connect_now());
}

TEST(ModbusPause, IsKeptAfterConnecting) {
  SilentListener listener;
  config::ModbusLink link = listener.link();
  link.pause_after_connect_s = 0.5;
  SimulatedClock clock;
  auto connection = make(link, clock);
  EXPECT_THAT(connection->connect().error().what, HasSubstr("wants 0.4 s more"));
  EXPECT_EQ(read(*connection, 0, 1).error().kind, ErrorKind::unavailable);
  clock.advance(400ms);
  EXPECT_TRUE(connection->connect());
  EXPECT_EQ(connection->counters().connects, 1U);
}

}  // namespace
}  // namespace shaker::drivers::modbus
