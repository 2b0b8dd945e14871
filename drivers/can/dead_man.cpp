#include "drivers/can/dead_man.hpp"

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/bcm.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/can/can_socket.hpp"

namespace shaker::drivers::can {
namespace {

using protocol::can::Frame;

// Size of a message to and from the kernel: a head and one frame.
constexpr std::size_t kBytes = sizeof(bcm_msg_head) + sizeof(can_frame);

can_frame to_wire(const Frame& frame) {
  can_frame wire{};
  wire.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U);
  wire.can_dlc = frame.length;
  std::memcpy(wire.data, frame.data.data(), frame.length);
  return wire;
}

bool write_message(int fd, const bcm_msg_head& head, const can_frame* frame) {
  std::array<unsigned char, kBytes> bytes{};
  std::memcpy(bytes.data(), &head, sizeof head);
  std::size_t size = sizeof head;
  if (frame != nullptr) {
    std::memcpy(bytes.data() + size, frame, sizeof *frame);
    size += sizeof *frame;
  }
  return ::write(fd, bytes.data(), size) == static_cast<ssize_t>(size);
}

struct Reply {
  std::uint32_t opcode = 0;
  can_frame frame{};
};

// Returns nothing if there is no message; errno gives the reason.
std::optional<Reply> read_message(int fd) {
  std::array<unsigned char, kBytes> bytes{};
  const auto got = ::recv(fd, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (got < static_cast<ssize_t>(sizeof(bcm_msg_head))) {
    if (got >= 0) errno = EAGAIN;
    return std::nullopt;
  }
  Reply reply;
  std::memcpy(&reply.opcode, bytes.data() + offsetof(bcm_msg_head, opcode), sizeof reply.opcode);
  std::memcpy(&reply.frame, bytes.data() + sizeof(bcm_msg_head), sizeof reply.frame);
  return reply;
}

}  // namespace

Result<DeadMan> DeadMan::open(const std::string& interface) {
  auto fd = open_can(SOCK_DGRAM, CAN_BCM);
  if (!fd) return fd.error();
  const auto index = find_interface(fd->get(), interface);
  if (!index) return index.error();
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = *index;
  if (::connect(fd->get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return link_error(errno, interface);
  }
  DeadMan dead_man;
  dead_man.fd_ = std::move(*fd);
  dead_man.interface_ = interface;
  return dead_man;
}

Result<void> DeadMan::arm(const Frame& frame, Nanoseconds period, unsigned count) {
  bcm_msg_head head;  // its empty array of frames cannot be initialised in ISO C++
  std::memset(&head, 0, sizeof head);
  head.opcode = TX_SETUP;
  head.flags = SETTIMER | STARTTIMER | TX_COUNTEVT | TX_CP_CAN_ID;
  head.count = count;  // of ival1; ival2 = 0 ends the sending after them
  head.ival1.tv_sec = period.count() / 1'000'000'000;
  head.ival1.tv_usec = period.count() / 1'000 % 1'000'000;
  head.can_id = to_wire(frame).can_id;
  head.nframes = 1;
  const can_frame wire = to_wire(frame);
  if (!write_message(fd_.get(), head, &wire)) return link_error(errno, interface_);
  return {};
}

Result<void> DeadMan::verify(const Frame& frame) {
  bcm_msg_head ask;  // as in arm()
  std::memset(&ask, 0, sizeof ask);
  ask.opcode = TX_READ;
  ask.can_id = to_wire(frame).can_id;
  if (!write_message(fd_.get(), ask, nullptr)) return link_error(errno, interface_);
  while (const auto reply = read_message(fd_.get())) {
    if (reply->opcode == TX_EXPIRED) expired_ = true;
    if (reply->opcode != TX_STATUS) continue;
    const can_frame wire = to_wire(frame);
    if (reply->frame.can_dlc == wire.can_dlc &&
        std::memcmp(reply->frame.data, wire.data, wire.can_dlc) == 0) {
      return {};
    }
    return Error{
        ErrorKind::io,
        fmt::format("{}: the kernel does not hold the setpoint that was written", interface_)};
  }
  return link_error(errno, interface_);
}

Result<bool> DeadMan::expired() {
  while (const auto reply = read_message(fd_.get())) {
    if (reply->opcode == TX_EXPIRED) expired_ = true;
  }
  if (errno != EAGAIN && errno != EINTR) return link_error(errno, interface_);
  return std::exchange(expired_, false);
}

}  // namespace shaker::drivers::can
