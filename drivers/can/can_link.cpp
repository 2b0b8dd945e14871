// Finds the interface and describes its errors.
#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <linux/can.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "drivers/can/can_socket.hpp"

namespace shaker::drivers::can {

Result<UniqueFd> open_can(int type, int protocol) {
  UniqueFd fd(::socket(PF_CAN, type | SOCK_CLOEXEC | SOCK_NONBLOCK, protocol));
  if (fd.valid()) return fd;
  if (errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT) {
    return Error{
        ErrorKind::unavailable,
        fmt::format("this kernel has no CAN ({}), or the service's sandbox hides it: load it with "
                    "'modprobe -a can-raw can-bcm', or use the Modbus sensor",
                    std::strerror(errno))};
  }
  return Error{ErrorKind::io, fmt::format("cannot open a CAN socket: {}", std::strerror(errno))};
}

Result<int> find_interface(int any_can_socket, const std::string& interface) {
  ifreq request{};
  if (interface.empty() || interface.size() >= sizeof request.ifr_name) {
    return Error{ErrorKind::invalid,
                 fmt::format("'{}' is no name of an interface, expected 1 to {} letters "
                             "such as can0",
                             interface, sizeof request.ifr_name - 1)};
  }
  std::memcpy(request.ifr_name, interface.data(), interface.size());
  if (::ioctl(any_can_socket, SIOCGIFINDEX, &request) != 0) {
    return Error{
        ErrorKind::unavailable,
        fmt::format("there is no interface {}: is the adapter plugged in? 'ip -br link show type "
                    "can' lists what there is",
                    interface)};
  }
  const int index = request.ifr_ifindex;
  if (::ioctl(any_can_socket, SIOCGIFFLAGS, &request) != 0) return link_error(errno, interface);
  if ((request.ifr_flags & IFF_UP) == 0) return link_error(ENETDOWN, interface);
  return index;
}

Error link_error(int error_number, const std::string& interface) {
  switch (error_number) {
    case ENETDOWN:
      return {ErrorKind::unavailable,
              fmt::format(
                  "{} is down: set it up with 'ip link set {} up type can bitrate 500000' (at the "
                  "bus's own rate)",
                  interface, interface)};
    case ENODEV:
    case ENXIO:
      return {
          ErrorKind::unavailable,
          fmt::format("{} is gone, or is no CAN interface: is the adapter plugged in?", interface)};
    case ENOBUFS:
      return {
          ErrorKind::exhausted,
          fmt::format(
              "{}: the send queue is full: nobody on the bus acknowledges; check that the other "
              "node is powered, the wiring and the bit rate",
              interface)};
    default:
      return {ErrorKind::io, fmt::format("{}: {}", interface, std::strerror(error_number))};
  }
}

}  // namespace shaker::drivers::can
