// A raw SocketCAN socket: kernel filters, kernel receive stamps, error frames, overflow counted.
//
// One thread. Nothing allocates after open(). Source: Linux Documentation/networking/can.rst,
// timestamping.rst; what the kernel does when a link goes away was measured (README.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "base/unique_fd.hpp"
#include "drivers/can/frame_decoder.hpp"
#include "protocol/can/frame.hpp"

namespace shaker::drivers::can {

struct Received {
  protocol::can::Frame frame;
  Nanoseconds utc{};      // the kernel's receive stamp; zero when there is none
  bool hardware = false;  // the adapter stamped it too, by its own clock
};

// The interface's number. An Error says what is missing: CAN in the kernel, the interface, the
// link.
Result<int> find_interface(int any_can_socket, const std::string& interface);
// socket(2), with a sentence when this kernel has no CAN.
Result<UniqueFd> open_can(int type, int protocol);
// The sentence for a failed call on an open CAN socket.
Error link_error(int error_number, const std::string& interface);

class CanSocket {
 public:
  struct Options {
    std::string interface;
    std::vector<Identifier> identifiers;  // nothing else is let through by the kernel
    bool fd = false;
    bool error_frames = true;
    int receive_buffer = 8 << 20;  // bytes
  };
  static Result<CanSocket> open(const Options& options);
  CanSocket(CanSocket&&) noexcept;
  CanSocket& operator=(CanSocket&&) noexcept;
  ~CanSocket();

  // Waits at most `timeout` for a frame and takes those that are there, at most out.size() and
  // kBatch. An Error means that the link is down or gone.
  Result<std::size_t> receive(std::span<Received> out, Nanoseconds timeout);
  Result<void> send(const protocol::can::Frame& frame);

  // Frames that the kernel dropped because the receive queue was full, since open().
  std::uint64_t dropped() const { return dropped_; }
  // True while the interface that was opened is still the one of that name.
  bool still_there() const;
  // Empty, or a sentence about what could not be had.
  const std::string& shortcoming() const { return shortcoming_; }

  static constexpr std::size_t kBatch = 64;

 private:
  struct Buffers;
  CanSocket();
  Result<void> set_up(const Options& options);
  void grow_receive_buffer(int bytes);

  UniqueFd fd_;
  std::string interface_;
  int index_ = 0;
  std::uint64_t dropped_ = 0;
  std::uint32_t drop_counter_ = 0;  // the kernel's, which wraps
  std::string shortcoming_;
  std::unique_ptr<Buffers> buffers_;
};

}  // namespace shaker::drivers::can
