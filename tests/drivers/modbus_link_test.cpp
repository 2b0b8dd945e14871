// Which links are accepted, and what happens when no server answers.
#include <array>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "base/unique_fd.hpp"
#include "drivers/modbus/connection.hpp"
#include "drivers/modbus/poll_decoder.hpp"

namespace shaker::drivers::modbus {
namespace {

using testing::HasSubstr;

// The queue of a listener that accepts no connection fills; then a handshake is not answered.
TEST(ModbusConnect, GivesUpAHandshakeThatIsNotAnswered) {
  const UniqueFd listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof here;
  auto* address = reinterpret_cast<sockaddr*>(&here);
  ASSERT_EQ(::bind(listener.get(), address, size), 0);
  ASSERT_EQ(::listen(listener.get(), 0), 0);
  ASSERT_EQ(::getsockname(listener.get(), address, &size), 0);
  std::vector<UniqueFd> queued;
  for (int i = 0; i < 4; ++i) {
    queued.emplace_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    ::connect(queued.back().get(), address, size);
  }
  RealClock clock;
  config::ModbusLink link;
  link.transport = config::ModbusTcp{"127.0.0.1", ntohs(here.sin_port)};
  link.response_timeout_s = 0.1;
  auto connection = ModbusConnection::make(link, clock);
  ASSERT_TRUE(connection);
  const auto outcome = (*connection)->connect();
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.error().what, HasSubstr("Connection timed out"));
  EXPECT_FALSE((*connection)->connected());
}

// The kernel refuses the broadcast address at once, without a handshake.
TEST(ModbusConnect, ReportsAnAddressThatTheKernelRefuses) {
  RealClock clock;
  config::ModbusLink link;
  link.transport = config::ModbusTcp{"255.255.255.255", 502};
  link.response_timeout_s = 0.1;
  auto connection = ModbusConnection::make(link, clock);
  ASSERT_TRUE(connection);
  EXPECT_FALSE((*connection)->connect());
  EXPECT_FALSE((*connection)->connected());
}

TEST(ModbusPolls, TakeAStampThatWrapsAfterTwoSecondsAndNoneThatWrapsSooner) {
  protocol::modbus::RegisterSpec stroke, stamp;
  stamp.address = static_cast<decltype(stamp.address)>(stroke.address + 1);
  stamp.type = protocol::modbus::RegisterType::u16;
  stamp.unit = "us";
  const auto taken = [&](double scale) {
    stamp.scale = scale;
    return PollDecoder::make({{protocol::Channel::displacement, stroke}}, stamp).ok();
  };
  EXPECT_TRUE(taken(2e6 / 65536.0)) << "2 s exactly";
  EXPECT_FALSE(taken(1.99e6 / 65536.0));
}

TEST(ModbusPolls, WithoutAStampAreOfTheMiddleBetweenRequestAndAnswer) {
  protocol::modbus::RegisterSpec stroke;
  auto decoder = PollDecoder::make({{protocol::Channel::displacement, stroke}}, std::nullopt);
  ASSERT_TRUE(decoder) << decoder.error().what;
  std::array<Sample, 1> out;
  ASSERT_EQ(decoder->decode(std::chrono::milliseconds(10), std::chrono::milliseconds(30), out), 1u);
  EXPECT_EQ(out[0].t, std::chrono::milliseconds(20));
}

TEST(ModbusLinkSettings, AreRefusedWithTheValueAndWhatIsAllowed) {
  RealClock clock;
  const auto refusal = [&](auto change) {
    config::ModbusLink link;
    change(link);
    const auto made = ModbusConnection::make(link, clock);
    return made ? std::string("accepted") : made.error().what;
  };
  using Link = config::ModbusLink;
  EXPECT_EQ(refusal([](Link&) {}), "accepted");
  EXPECT_THAT(refusal([](Link& l) {
                l.transport = config::ModbusTcp{"rig.example", 502};
              }),
              HasSubstr("host \"rig.example\" must be a numeric address"));
  EXPECT_EQ(refusal([](Link& l) { l.transport = config::ModbusTcp{"::1", 502}; }), "accepted");
  EXPECT_THAT(refusal([](Link& l) {
                l.transport = config::ModbusTcp{"10.0.0.1", 70000};
              }),
              HasSubstr("port 70000 must be 1..65535"));
  EXPECT_THAT(refusal([](Link& l) { l.unit_id = 248; }), HasSubstr("unit_id 248 must be 0..247"));
  EXPECT_THAT(refusal([](Link& l) { l.response_timeout_s = 0.0; }),
              HasSubstr("response_timeout_s 0 must be 0.001 to 60"));
  EXPECT_THAT(refusal([](Link& l) { l.timeouts_before_close = 0; }),
              HasSubstr("timeouts_before_close 0"));
  EXPECT_THAT(refusal([](Link& l) {
                l.transport = config::ModbusRtu{"/dev/ttyS0", 12345, 'E', 1};
              }),
              HasSubstr("baud 12345 must be one of"));
  EXPECT_THAT(refusal([](Link& l) {
                l.transport = config::ModbusRtu{"/dev/ttyS0", 9600, 'x', 1};
              }),
              HasSubstr("parity 'x' must be N, E or O"));
  for (const char parity : {'N', 'E', 'O'}) {
    for (const int stop_bits : {1, 2}) {
      EXPECT_EQ(refusal([&](Link& l) {
                  l.transport = config::ModbusRtu{"/dev/ttyS0", 9600, parity, stop_bits};
                }),
                "accepted");
    }
  }
  EXPECT_THAT(refusal([](Link& l) {
                l.transport = config::ModbusRtu{"/dev/ttyS0", 9600, 'N', 3};
              }),
              HasSubstr("stop_bits 3 must be 1 or 2"));
  EXPECT_THAT(refusal([](Link& l) {
                l.transport = config::ModbusRtu{"/dev/ttyS0", 9600, 'N', 2};
                l.unit_id = 0;
              }),
              HasSubstr("unit_id 0 must be 1..247"));
}

}  // namespace
}  // namespace shaker::drivers::modbus
