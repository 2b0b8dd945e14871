#include "daemon/service/exciter_address.hpp"

#include <filesystem>
#include <ifaddrs.h>
#include <stdlib.h>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>

#include "base/unique_fd.hpp"
#include "tests/record/scratch.hpp"

namespace shaker::daemon {
namespace {

using record::testing::Scratch;
using ::testing::HasSubstr;

std::string address_of(const config::RigConfig& rig) {
  const auto address = exciter_address(rig);
  if (!address) return address.error().what;
  return address->value_or("none");
}

config::RigConfig tcp(const std::string& host, int port = 502, int unit = 1) {
  config::ModbusExciter exciter;
  exciter.link.transport = config::ModbusTcp{host, port};
  exciter.link.unit_id = unit;
  config::RigConfig rig;
  rig.exciter.device = exciter;
  return rig;
}

config::RigConfig rtu(const std::string& device, int unit = 1) {
  config::ModbusExciter exciter;
  exciter.link.transport = config::ModbusRtu{device};
  exciter.link.unit_id = unit;
  config::RigConfig rig;
  rig.exciter.device = exciter;
  return rig;
}

// An address of this PC other than the loopback's; empty when there is none.
std::string own_address() {
  std::string found;
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return found;
  for (const ifaddrs* one = all; one && found.empty(); one = one->ifa_next) {
    if (!one->ifa_addr || one->ifa_addr->sa_family != AF_INET) continue;
    const void* generic = one->ifa_addr;
    const auto& v4 = static_cast<const sockaddr_in*>(generic)->sin_addr;
    char text[INET_ADDRSTRLEN];
    ::inet_ntop(AF_INET, &v4, text, sizeof text);
    if (std::string(text).rfind("127.", 0) != 0) found = text;
  }
  ::freeifaddrs(all);
  return found;
}

TEST(ExciterAddress, IsTheSameForAllNamesOfThisPc) {
  for (const char* host : {"localhost", "127.0.0.1", "127.0.0.2", "::1", "::ffff:127.0.0.1",
                           "0:0:0:0:0:0:0:1", "0.0.0.0"}) {
    EXPECT_EQ(address_of(tcp(host)), "modbus-tcp-this-pc-502-unit-1") << host;
  }
  const std::string own = own_address();
  if (own.empty()) GTEST_SKIP() << "this PC has the loopback's address only";
  EXPECT_EQ(address_of(tcp(own)), "modbus-tcp-this-pc-502-unit-1") << own;
}

TEST(ExciterAddress, IsTheSameHoweverANumericAddressIsWritten) {
  EXPECT_EQ(address_of(tcp("192.0.2.20")), "modbus-tcp-192.0.2.20-502-unit-1");
  EXPECT_EQ(address_of(tcp("::ffff:192.0.2.20")), address_of(tcp("192.0.2.20")));
  EXPECT_EQ(address_of(tcp("2001:DB8:0:0::20")), address_of(tcp("2001:db8::20")));
}

TEST(ExciterAddress, TellsPortsAndUnitsApart) {
  EXPECT_NE(address_of(tcp("192.0.2.20", 502)), address_of(tcp("192.0.2.20", 503)));
  EXPECT_NE(address_of(tcp("192.0.2.20", 502, 1)), address_of(tcp("192.0.2.20", 502, 2)));
}

TEST(ExciterAddress, FollowsTheLinksToASerialLine) {
  const UniqueFd terminal(::posix_openpt(O_RDWR | O_NOCTTY));
  ASSERT_TRUE(terminal.valid());
  ASSERT_EQ(::unlockpt(terminal.get()), 0);
  const std::string device = ::ptsname(terminal.get());
  const Scratch scratch;
  std::filesystem::create_symlink(device, scratch.path() / "by-id");
  EXPECT_EQ(address_of(rtu((scratch.path() / "by-id").string())), address_of(rtu(device)));
  EXPECT_NE(address_of(rtu(device, 1)), address_of(rtu(device, 2)));
  EXPECT_EQ(address_of(rtu("/dev/ttyUSB77")), "modbus-rtu--dev-ttyUSB77-unit-1");  // unplugged
}

TEST(ExciterAddress, IsTheIdentifierOfTheSetpointMessageOnACanBus) {
  config::CanExciter exciter;
  exciter.interface = "can7";
  exciter.dbc = "shaker.dbc";
  exciter.setpoint_message = "SETPOINT";
  config::RigConfig rig;
  rig.directory = std::filesystem::path(SHAKER_SOURCE_DIR) / "config" / "examples";
  rig.exciter.device = exciter;
  EXPECT_EQ(address_of(rig), "can-can7-0x100");
  exciter.setpoint_message = "MISSING";
  rig.exciter.device = exciter;
  EXPECT_THAT(address_of(rig), HasSubstr("no message MISSING"));
}

TEST(ExciterAddress, IsNoneForDevicesThatMoveNothing) {
  config::RigConfig rig;
  rig.exciter.device = config::SimulatedExciter{};
  EXPECT_EQ(address_of(rig), "none");
  rig.exciter.device = config::ReplayExciter{};
  EXPECT_EQ(address_of(rig), "none");
}

}  // namespace
}  // namespace shaker::daemon
