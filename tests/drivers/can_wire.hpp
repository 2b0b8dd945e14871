// The other node for can_wire_test: system calls only, no code of drivers/can.
#pragma once

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <vector>

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace shaker::drivers::can {

inline void run(const std::string& command) {
  if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
}

struct Seen {
  std::uint32_t id = 0;
  std::vector<std::uint8_t> data;
};

// A raw socket that receives every frame of an interface, including error frames.
inline int open_raw(const char* interface) {
  const int fd = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK, CAN_RAW);
  const int on = 1;
  const can_err_mask_t errors = CAN_ERR_MASK;
  ::setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on);
  ::setsockopt(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(interface));
  if (fd < 0 || ::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    throw std::runtime_error(std::string("no peer on ") + interface);
  }
  return fd;
}

// Another node on the bus; it sees every frame except its own. When `send` returns, the frame
// has arrived at every socket: a busy kernel delivers frames later, so a second socket waits
// for it.
class Peer {
 public:
  explicit Peer(const char* interface) : fd_(open_raw(interface)), witness_(open_raw(interface)) {}
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  ~Peer() {
    ::close(fd_);
    ::close(witness_);
  }

  void send(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    can_frame frame{};
    frame.can_id = id;
    for (const auto byte : data)
      frame.data[frame.can_dlc++] = byte;
    deliver(frame);
  }
  void send_raw(std::uint32_t id, std::uint8_t length) {  // zeros, without allocating
    can_frame frame{};
    frame.can_id = id;
    frame.can_dlc = length;
    deliver(frame);
  }
  void send_fd(std::uint32_t id, const std::vector<std::uint8_t>& data) {
    canfd_frame frame{};
    frame.can_id = id;
    frame.len = static_cast<std::uint8_t>(data.size());
    std::memcpy(frame.data, data.data(), data.size());
    deliver(frame);
  }
  std::vector<Seen> take_all() {
    std::vector<Seen> all;
    for (canfd_frame frame{}; ::read(fd_, &frame, sizeof frame) > 0;) {
      all.push_back({frame.can_id, {frame.data, frame.data + frame.len}});
    }
    return all;
  }
  // Returns all frames up to the `count`th `wanted` one, or those of five seconds.
  template <typename Predicate>
  std::vector<Seen> take_until(std::ptrdiff_t count, Predicate wanted) {
    std::vector<Seen> all;
    for (int tries = 0; tries < 5000; ++tries) {
      for (auto& seen : take_all())
        all.push_back(std::move(seen));
      if (std::count_if(all.begin(), all.end(), wanted) >= count) break;
      ::usleep(1000);
    }
    return all;
  }

 private:
  // can_frame and canfd_frame have identifier, length and data at the same offsets.
  template <typename Frame>
  void deliver(const Frame& frame) {
    for (int tries = 0; ::write(fd_, &frame, sizeof frame) != ssize_t{sizeof frame}; ++tries) {
      if (tries == 1000) throw std::runtime_error("the peer cannot send");
      ::usleep(1000);
    }
    Frame seen{};
    for (pollfd arrival{witness_, POLLIN, 0}; ::poll(&arrival, 1, 5000) == 1;) {
      if (::read(witness_, &seen, sizeof seen) == ssize_t{sizeof seen} &&
          seen.can_id == frame.can_id &&
          std::memcmp(seen.data, frame.data, sizeof frame.data) == 0) {
        return;
      }
    }
    throw std::runtime_error("the peer's frame did not arrive");
  }
  int fd_, witness_;
};

// An interface for this test alone.
class TemporaryLink {
 public:
  explicit TemporaryLink(const std::string& name) : name_(name) { add(); }
  TemporaryLink(const TemporaryLink&) = delete;
  TemporaryLink& operator=(const TemporaryLink&) = delete;
  ~TemporaryLink() { (void)!std::system(("ip link del " + name_).c_str()); }

  void add() {
    run("ip link add dev " + name_ + " type vcan");
    up();
  }
  void remove() { run("ip link del " + name_); }
  void up() { run("ip link set " + name_ + " up"); }
  void down() { run("ip link set " + name_ + " down"); }

 private:
  std::string name_;
};

}  // namespace shaker::drivers::can
