#include "daemon/publish/listener.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace shaker::daemon {
namespace {

TEST(TcpListener, SaysWhichPortTheKernelChose) {
  const auto listening = listen_tcp(0);
  ASSERT_TRUE(listening) << listening.error().what;
  const int port = bound_port(*listening);
  ASSERT_GT(port, 0);

  const UniqueFd client(::socket(AF_INET, SOCK_STREAM, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const void* raw = &address;
  EXPECT_EQ(::connect(client.get(), static_cast<const sockaddr*>(raw), sizeof address), 0);

  const auto second = listen_tcp(port);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().what, ::testing::HasSubstr("choose a port that is free"));
}

TEST(TcpListener, SaysNoPortOfWhatIsNoSocket) {
  EXPECT_EQ(bound_port(UniqueFd()), 0);
}

}  // namespace
}  // namespace shaker::daemon
