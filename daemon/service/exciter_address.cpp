#include "daemon/service/exciter_address.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include "base/unique_fd.hpp"
#include "drivers/can/dbc_file.hpp"

namespace shaker::daemon {
namespace {

using Address = Result<std::optional<std::string>>;

// True if the address belongs to this PC: only then can a socket be bound to it.
template <class SocketAddress>
bool on_this_pc(const SocketAddress& address, int family) {
  const UniqueFd probe(::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const void* generic = &address;
  return probe.valid() &&
         ::bind(probe.get(), static_cast<const sockaddr*>(generic), sizeof address) == 0;
}

std::string host_name(const in_addr& host) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr = host;
  if (on_this_pc(address, AF_INET)) return "this-pc";
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &host, text.data(), text.size());
  return text.data();
}

std::string host_name(const in6_addr& host) {
  if (IN6_IS_ADDR_V4MAPPED(&host)) {
    in_addr inner{};
    std::memcpy(&inner, &host.s6_addr[12], sizeof inner);
    return host_name(inner);
  }
  sockaddr_in6 address{};
  address.sin6_family = AF_INET6;
  address.sin6_addr = host;
  if (IN6_IS_ADDR_LOOPBACK(&host) || on_this_pc(address, AF_INET6)) return "this-pc";
  std::array<char, INET6_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET6, &host, text.data(), text.size());
  return text.data();
}

// Rig files contain numeric addresses or localhost (drivers/modbus/dial.cpp).
std::string host_name(const std::string& host) {
  in_addr v4{};
  in6_addr v6{};
  if (host == "localhost") return "this-pc";
  if (::inet_pton(AF_INET, host.c_str(), &v4) == 1) return host_name(v4);
  if (::inet_pton(AF_INET6, host.c_str(), &v6) == 1) return host_name(v6);
  return host;
}

std::string device_name(const std::string& device) {
  struct stat status {};
  if (::stat(device.c_str(), &status) == 0 && S_ISCHR(status.st_mode))
    return fmt::format("{}:{}", major(status.st_rdev), minor(status.st_rdev));
  std::error_code ignored;
  std::string name = std::filesystem::weakly_canonical(device, ignored).string();
  std::replace(name.begin(), name.end(), '/', '-');
  return name;
}

// An interface may have several names; the first one is used.
std::string interface_name(const std::string& name) {
  std::array<char, IF_NAMESIZE> first{};
  const unsigned index = ::if_nametoindex(name.c_str());
  return index != 0 && ::if_indextoname(index, first.data()) ? first.data() : name;
}

struct AddressOf {
  const config::RigConfig& rig;

  Address operator()(const config::ModbusExciter& exciter) const {
    const int unit = exciter.link.unit_id;
    if (const auto* tcp = std::get_if<config::ModbusTcp>(&exciter.link.transport)) {
      return std::optional(
          fmt::format("modbus-tcp-{}-{}-unit-{}", host_name(tcp->host), tcp->port, unit));
    }
    const auto& rtu = std::get<config::ModbusRtu>(exciter.link.transport);
    return std::optional(fmt::format("modbus-rtu-{}-unit-{}", device_name(rtu.device), unit));
  }
  Address operator()(const config::CanExciter& exciter) const {
    const auto database = drivers::can::load_dbc(rig.directory / exciter.dbc);
    if (!database) return database.error();
    const auto* message = database->find(exciter.setpoint_message);
    if (!message) {
      return Error{ErrorKind::invalid,
                   fmt::format("{}: there is no message {}; check the exciter's "
                               "setpoint_message.",
                               exciter.dbc.string(), exciter.setpoint_message)};
    }
    return std::optional(fmt::format("can-{}-{:#x}{}", interface_name(exciter.interface),
                                     message->id, message->extended ? "-extended" : ""));
  }
  Address operator()(const config::SimulatedExciter&) const { return std::optional<std::string>(); }
  Address operator()(const config::ReplayExciter&) const { return std::optional<std::string>(); }
};

}  // namespace

Result<std::optional<std::string>> exciter_address(const config::RigConfig& rig) {
  return std::visit(AddressOf{rig}, rig.exciter.device);
}

}  // namespace shaker::daemon
