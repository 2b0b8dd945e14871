#include "drivers/modbus/dial.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <optional>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include "base/unique_fd.hpp"

namespace shaker::drivers::modbus {
namespace {

using config::ModbusLink;
using config::ModbusRtu;
using config::ModbusTcp;

// libmodbus waits in select(), whose fd_set has this many descriptors.
constexpr int kDescriptorLimit = 1024;

// The rates that libmodbus knows; for any other it would use 9600 without an error.
constexpr int kBaudRates[] = {1200,  2400,   4800,   9600,   19200, 38400,
                              57600, 115200, 230400, 460800, 921600};

struct Address {
  sockaddr_storage storage{};
  socklen_t size = 0;
};

std::optional<Address> numeric_address(const ModbusTcp& tcp) {
  const std::string host = tcp.host == "localhost" ? "127.0.0.1" : tcp.host;
  Address address;
  sockaddr_in v4{};
  sockaddr_in6 v6{};
  if (inet_pton(AF_INET, host.c_str(), &v4.sin_addr) == 1) {
    v4.sin_family = AF_INET;
    v4.sin_port = htons(static_cast<std::uint16_t>(tcp.port));
    std::memcpy(&address.storage, &v4, sizeof v4);
    address.size = sizeof v4;
    return address;
  }
  if (inet_pton(AF_INET6, host.c_str(), &v6.sin6_addr) == 1) {
    v6.sin6_family = AF_INET6;
    v6.sin6_port = htons(static_cast<std::uint16_t>(tcp.port));
    std::memcpy(&address.storage, &v6, sizeof v6);
    address.size = sizeof v6;
    return address;
  }
  return std::nullopt;
}

Error invalid(std::string text) {
  return Error{ErrorKind::invalid, std::move(text)};
}

Error too_many_descriptors() {
  return Error{ErrorKind::exhausted,
               fmt::format("more than {} files are open in this process, which libmodbus cannot "
                           "bear; lower the number of clients or devices",
                           kDescriptorLimit)};
}

Error no_connection(int error) {
  const char* remedy = error == ECONNREFUSED
                           ? "the device is there but its Modbus port is closed: check the port"
                           : "check power, cable and address";
  return Error{ErrorKind::unavailable,
               fmt::format("no connection ({}): {}", std::strerror(error), remedy)};
}

// Returns 0, or the errno of the failure.
int finish_connect(int fd, Nanoseconds timeout) {
  pollfd wait{fd, POLLOUT, 0};
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(timeout).count();
  const int ready = ::poll(&wait, 1, static_cast<int>(ms));
  if (ready <= 0) return ready == 0 ? ETIMEDOUT : errno;
  int error = 0;
  socklen_t size = sizeof error;
  return ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
}

// A pseudo terminal has no parity. Debian's tcsetattr() refuses a parity if nothing else
// changes, as at the second opening.
bool is_pseudo_terminal(const std::string& device) {
  struct stat status {};
  if (::stat(device.c_str(), &status) != 0) return false;
  const auto kind = major(status.st_rdev);  // of Unix98 slaves: Linux devices.txt
  return S_ISCHR(status.st_mode) && kind >= 136 && kind <= 143;
}

Result<Context> make_context(const ModbusLink& link) {
  Context context;
  if (const auto* rtu = std::get_if<ModbusRtu>(&link.transport)) {
    const char parity = is_pseudo_terminal(rtu->device) ? 'N' : rtu->parity;
    context.reset(modbus_new_rtu(rtu->device.c_str(), rtu->baud, parity, 8, rtu->stop_bits));
  } else {
    // Only its codec is used; dial_tcp connects.
    context.reset(modbus_new_tcp("127.0.0.1", 502));
  }
  if (!context || modbus_set_slave(context.get(), link.unit_id) != 0) {
    return invalid(fmt::format("libmodbus refuses the link: {}", modbus_strerror(errno)));
  }
  modbus_set_error_recovery(context.get(), MODBUS_ERROR_RECOVERY_NONE);
  // Zero: the whole answer must arrive within the response timeout. With a timeout for each
  // byte a slow device could block for minutes.
  modbus_set_byte_timeout(context.get(), 0, 0);
  return context;
}

Result<void> dial_tcp(modbus_t* context, const ModbusTcp& tcp, Nanoseconds timeout) {
  const std::optional<Address> address = numeric_address(tcp);
  if (!address) return invalid("not a numeric address");
  UniqueFd fd(::socket(address->storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd.valid()) return Error{ErrorKind::io, std::strerror(errno)};
  if (fd.get() >= kDescriptorLimit) return too_many_descriptors();
  const int now = 1;
  ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &now, sizeof now);
  const auto* to = reinterpret_cast<const sockaddr*>(&address->storage);
  int error = ::connect(fd.get(), to, address->size) == 0 ? 0 : errno;
  if (error == EINPROGRESS || error == EINTR) error = finish_connect(fd.get(), timeout);
  if (error != 0) return no_connection(error);
  modbus_set_socket(context, fd.release());
  return {};
}

Result<void> dial_rtu(modbus_t* context, const ModbusRtu& rtu) {
  {
    // The serial line will get the lowest free descriptor.
    const UniqueFd probe(::dup(STDERR_FILENO));
    if (probe.get() >= kDescriptorLimit) return too_many_descriptors();
  }
  if (modbus_connect(context) != 0) {
    return Error{ErrorKind::unavailable,
                 fmt::format("the serial line cannot be opened ({}): check that {} exists and that "
                             "the service's user may use it (group dialout)",
                             modbus_strerror(errno), rtu.device)};
  }
  // Two masters on one line would destroy each other's frames.
  if (::flock(modbus_get_socket(context), LOCK_EX | LOCK_NB) != 0) {
    return Error{ErrorKind::unavailable,
                 fmt::format("{} is in use by another program or device of this rig: a serial line "
                             "has one master",
                             rtu.device)};
  }
  return {};
}

Result<void> validate_transport(const ModbusTcp& tcp) {
  if (tcp.port < 1 || tcp.port > 65535) {
    return invalid(fmt::format("port {} must be 1..65535 (Modbus' own is 502)", tcp.port));
  }
  if (!numeric_address(tcp)) {
    return invalid(
        fmt::format("host \"{}\" must be a numeric address such as 192.168.1.10 (or "
                    "localhost): no name server may stand between the rig and its stop",
                    tcp.host));
  }
  return {};
}

Result<void> validate_transport(const ModbusRtu& rtu) {
  if (rtu.device.empty()) return invalid("device of a serial line is missing, e.g. /dev/ttyUSB0");
  if (std::find(std::begin(kBaudRates), std::end(kBaudRates), rtu.baud) == std::end(kBaudRates)) {
    return invalid(
        fmt::format("baud {} must be one of 1200, 2400, 4800, 9600, 19200, 38400, "
                    "57600, 115200, 230400, 460800, 921600",
                    rtu.baud));
  }
  if (rtu.parity != 'N' && rtu.parity != 'E' && rtu.parity != 'O') {
    return invalid(fmt::format("parity '{}' must be N, E or O", rtu.parity));
  }
  if (rtu.stop_bits != 1 && rtu.stop_bits != 2) {
    return invalid(fmt::format("stop_bits {} must be 1 or 2", rtu.stop_bits));
  }
  return {};
}

bool in_range(double value, double low, double high) {
  return value >= low && value <= high;
}

}  // namespace

std::string describe(const ModbusLink& link) {
  if (const auto* tcp = std::get_if<ModbusTcp>(&link.transport)) {
    return fmt::format("Modbus TCP {}:{} unit {}", tcp->host, tcp->port, link.unit_id);
  }
  const auto& rtu = std::get<ModbusRtu>(link.transport);
  return fmt::format("Modbus RTU {} {} 8{}{} unit {}", rtu.device, rtu.baud, rtu.parity,
                     rtu.stop_bits, link.unit_id);
}

Result<void> validate(const ModbusLink& link) {
  const bool tcp = std::holds_alternative<ModbusTcp>(link.transport);
  if (tcp ? !(in_range(link.unit_id, 0, 247) || link.unit_id == 255)
          : !in_range(link.unit_id, 1, 247)) {
    return invalid(
        fmt::format("unit_id {} must be {}", link.unit_id, tcp ? "0..247 or 255" : "1..247"));
  }
  if (!in_range(link.response_timeout_s, 0.001, 60.0)) {
    return invalid(
        fmt::format("response_timeout_s {} must be 0.001 to 60", link.response_timeout_s));
  }
  if (!in_range(link.pause_after_connect_s, 0.0, 60.0)) {
    return invalid(
        fmt::format("pause_after_connect_s {} must be 0 to 60", link.pause_after_connect_s));
  }
  if (!in_range(link.reconnect_s, 0.001, 30.0)) {
    return invalid(fmt::format("reconnect_s {} must be 0.001 to 30", link.reconnect_s));
  }
  if (link.timeouts_before_close < 1) {
    return invalid(
        fmt::format("timeouts_before_close {} must be 1 or more", link.timeouts_before_close));
  }
  return std::visit([](const auto& transport) { return validate_transport(transport); },
                    link.transport);
}

Result<Context> dial(const ModbusLink& link, Nanoseconds timeout) {
  Result<Context> context = make_context(link);
  if (!context) return context;
  const auto* tcp = std::get_if<ModbusTcp>(&link.transport);
  const Result<void> dialled = tcp ? dial_tcp(context->get(), *tcp, timeout)
                                   : dial_rtu(context->get(), std::get<ModbusRtu>(link.transport));
  if (!dialled) return dialled.error();
  return context;
}

}  // namespace shaker::drivers::modbus
