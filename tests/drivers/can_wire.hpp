// The other side of the wire for can_wire_test: plain system calls, nothing of drivers/can.
#pragma once

#include <array>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <vector>

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
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

// Another node on the bus; sees everything but its own frames.
class Peer {
 public:
  explicit Peer(const char* interface) : fd_(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK, CAN_RAW)) {
    const int on = 1;
    ::setsockopt(fd_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex(interface));
    if (fd_ < 0 || ::bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error(std::string("no peer on ") + interface);
    }
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  ~Peer() { ::close(fd_); }

  void send(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    can_frame frame{};
    frame.can_id = id;
    for (const auto byte : data)
      frame.data[frame.can_dlc++] = byte;
    write_all(&frame, sizeof frame);
  }
  void send_raw(std::uint32_t id, std::uint8_t length) {  // zeros, without allocating
    can_frame frame{};
    frame.can_id = id;
    frame.can_dlc = length;
    write_all(&frame, sizeof frame);
  }
  void send_fd(std::uint32_t id, const std::vector<std::uint8_t>& data) {
    canfd_frame frame{};
    frame.can_id = id;
    frame.len = static_cast<std::uint8_t>(data.size());
    std::memcpy(frame.data, data.data(), data.size());
    write_all(&frame, sizeof frame);
  }
  std::vector<Seen> take_all() {
    std::vector<Seen> all;
    for (canfd_frame frame{}; ::read(fd_, &frame, sizeof frame) > 0;) {
      all.push_back({frame.can_id, {frame.data, frame.data + frame.len}});
    }
    return all;
  }

 private:
  void write_all(const void* frame, std::size_t size) {
    for (int tries = 0; tries < 1000; ++tries) {
      if (::write(fd_, frame, size) == static_cast<ssize_t>(size)) return;
      ::usleep(1000);
    }
    throw std::runtime_error("the peer cannot send");
  }
  int fd_;
};

// An interface of this test alone.
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
