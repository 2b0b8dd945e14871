#include "drivers/can/can_socket.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace shaker::drivers::can {
namespace {

using protocol::can::Frame;

Nanoseconds from_timespec(const timespec& t) {
  return std::chrono::seconds(t.tv_sec) + Nanoseconds(t.tv_nsec);
}

Frame to_frame(const canfd_frame& wire, std::size_t bytes) {
  Frame frame;
  frame.error = (wire.can_id & CAN_ERR_FLAG) != 0;
  frame.extended = !frame.error && (wire.can_id & CAN_EFF_FLAG) != 0;
  frame.remote = !frame.error && (wire.can_id & CAN_RTR_FLAG) != 0;
  frame.id = wire.can_id & (frame.extended || frame.error ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.fd = bytes == CANFD_MTU;
  const std::size_t most = frame.fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN;
  frame.length = static_cast<std::uint8_t>(std::min<std::size_t>(wire.len, most));
  std::memcpy(frame.data.data(), wire.data, frame.length);
  return frame;
}

can_filter to_filter(const Identifier& identifier) {
  can_filter filter{};
  filter.can_id = identifier.id | (identifier.extended ? CAN_EFF_FLAG : 0U);
  filter.can_mask =
      (identifier.extended ? CAN_EFF_MASK : CAN_SFF_MASK) | CAN_EFF_FLAG | CAN_RTR_FLAG;
  return filter;
}

template <class Value>
bool set_option(int fd, int level, int name, const Value& value) {
  return ::setsockopt(fd, level, name, &value, sizeof value) == 0;
}

}  // namespace

// Memory for one recvmmsg(2) of kBatch frames with their stamps and drop counters.
struct CanSocket::Buffers {
  static constexpr std::size_t kControl =
      CMSG_SPACE(sizeof(scm_timestamping)) + CMSG_SPACE(sizeof(std::uint32_t));
  struct alignas(cmsghdr) Control {
    std::array<unsigned char, kControl> bytes;
  };
  std::array<canfd_frame, kBatch> frames{};
  std::array<Control, kBatch> controls{};
  std::array<iovec, kBatch> vectors{};
  std::array<mmsghdr, kBatch> messages{};

  void prepare(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      vectors[i] = {&frames[i], sizeof frames[i]};
      messages[i] = {};
      messages[i].msg_hdr.msg_iov = &vectors[i];
      messages[i].msg_hdr.msg_iovlen = 1;
      messages[i].msg_hdr.msg_control = controls[i].bytes.data();
      messages[i].msg_hdr.msg_controllen = kControl;
    }
  }
};

CanSocket::CanSocket() : buffers_(std::make_unique<Buffers>()) {}
CanSocket::CanSocket(CanSocket&&) noexcept = default;
CanSocket& CanSocket::operator=(CanSocket&&) noexcept = default;
CanSocket::~CanSocket() = default;

Result<CanSocket> CanSocket::open(const Options& options) {
  CanSocket socket;
  socket.interface_ = options.interface;
  auto fd = open_can(SOCK_RAW, CAN_RAW);
  if (!fd) return fd.error();
  socket.fd_ = std::move(*fd);
  const auto index = find_interface(socket.fd_.get(), options.interface);
  if (!index) return index.error();
  socket.index_ = *index;
  if (const auto done = socket.set_up(options); !done) return done.error();
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = socket.index_;
  if (::bind(socket.fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return link_error(errno, options.interface);
  }
  return socket;
}

// Called before bind(2), so that no frame arrives unfiltered or without a stamp.
Result<void> CanSocket::set_up(const Options& options) {
  const int fd = fd_.get();
  std::vector<can_filter> filters;
  for (const Identifier& identifier : options.identifiers)
    filters.push_back(to_filter(identifier));
  const auto bytes = static_cast<socklen_t>(filters.size() * sizeof(can_filter));
  if (::setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), bytes) != 0) {
    return link_error(errno, interface_);
  }
  if (options.error_frames) {
    const can_err_mask_t all = CAN_ERR_MASK;
    if (!set_option(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, all)) return link_error(errno, interface_);
  }
  const int stamps =
      SOF_TIMESTAMPING_SOFTWARE | SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_RAW_HARDWARE;
  if (!set_option(fd, SOL_SOCKET, SO_TIMESTAMPING, stamps) ||
      !set_option(fd, SOL_SOCKET, SO_RXQ_OVFL, 1)) {
    return link_error(errno, interface_);
  }
  if (options.fd) {
    ifreq request{};
    interface_.copy(request.ifr_name, sizeof request.ifr_name - 1);
    if (::ioctl(fd, SIOCGIFMTU, &request) != 0 || request.ifr_mtu < static_cast<int>(CANFD_MTU)) {
      return Error{
          ErrorKind::invalid,
          fmt::format("{} is not set up for CAN FD: 'ip link set {} up type can bitrate 500000 "
                      "dbitrate 2000000 fd on', or leave out \"fd\"",
                      interface_, interface_)};
    }
    if (!set_option(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, 1)) return link_error(errno, interface_);
  }
  grow_receive_buffer(options.receive_buffer);
  return {};
}

// The default holds 278 classic frames: a quarter of a second at 1 kHz. Only a privileged
// process may exceed net.core.rmem_max.
void CanSocket::grow_receive_buffer(int bytes) {
  if (set_option(fd_.get(), SOL_SOCKET, SO_RCVBUFFORCE, bytes)) return;
  set_option(fd_.get(), SOL_SOCKET, SO_RCVBUF, bytes);
  int got = 0;
  socklen_t size = sizeof got;
  ::getsockopt(fd_.get(), SOL_SOCKET, SO_RCVBUF, &got, &size);
  if (got / 2 >= bytes) return;  // the kernel reports twice the requested size
  shortcoming_ = fmt::format(
      "{}: the receive buffer is {} KiB instead of {} KiB, so that a pause loses frames sooner: "
      "set "
      "net.core.rmem_max={} or give the service CAP_NET_ADMIN",
      interface_, got / 2048, bytes / 1024, bytes);
}

Result<std::size_t> CanSocket::receive(std::span<Received> out, Nanoseconds timeout) {
  const auto nanoseconds = std::max<std::int64_t>(0, timeout.count());
  const timespec limit{nanoseconds / 1'000'000'000, nanoseconds % 1'000'000'000};
  pollfd waiting{fd_.get(), POLLIN, 0};
  const int ready = ::ppoll(&waiting, 1, &limit, nullptr);
  if (ready == 0 || (ready < 0 && errno == EINTR)) return std::size_t{0};
  if (ready < 0) return link_error(errno, interface_);

  const std::size_t most = std::min(out.size(), kBatch);
  buffers_->prepare(most);
  const int got = ::recvmmsg(fd_.get(), buffers_->messages.data(), static_cast<unsigned>(most),
                             MSG_DONTWAIT, nullptr);
  if (got < 0) {
    if (errno == EAGAIN || errno == EINTR) return std::size_t{0};
    return link_error(errno, interface_);
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(got); ++i) {
    auto& message = buffers_->messages[i];
    out[i] = {to_frame(buffers_->frames[i], message.msg_len), {}, false};
    for (cmsghdr* c = CMSG_FIRSTHDR(&message.msg_hdr); c; c = CMSG_NXTHDR(&message.msg_hdr, c)) {
      if (c->cmsg_level != SOL_SOCKET) continue;
      if (c->cmsg_type == SO_TIMESTAMPING) {
        scm_timestamping stamps{};
        std::memcpy(&stamps, CMSG_DATA(c), sizeof stamps);
        out[i].utc = from_timespec(stamps.ts[0]);
        out[i].hardware = from_timespec(stamps.ts[2]).count() != 0;
      } else if (c->cmsg_type == SO_RXQ_OVFL) {
        std::uint32_t counter = 0;
        std::memcpy(&counter, CMSG_DATA(c), sizeof counter);
        dropped_ += counter - drop_counter_;
        drop_counter_ = counter;
      }
    }
  }
  return static_cast<std::size_t>(got);
}

Result<void> CanSocket::send(const Frame& frame) {
  canfd_frame wire{};
  wire.can_id =
      frame.id | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.remote ? CAN_RTR_FLAG : 0U);
  wire.len = frame.length;
  std::memcpy(wire.data, frame.data.data(), frame.length);
  const std::size_t bytes = frame.fd ? CANFD_MTU : CAN_MTU;
  if (::write(fd_.get(), &wire, bytes) != static_cast<ssize_t>(bytes))
    return link_error(errno, interface_);
  return {};
}

bool CanSocket::still_there() const {
  return ::if_nametoindex(interface_.c_str()) == static_cast<unsigned>(index_);
}

}  // namespace shaker::drivers::can
