// A raw SocketCAN socket with kernel filters, kernel receive stamps, error frames and a count
// of dropped frames.
//
// One thread. Nothing allocates after open(), except for an Error. Source: Linux
// Documentation/networking/can.rst, timestamping.rst; README.md has the measured behaviour of
// the kernel when a link goes away.
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
  Nanoseconds utc{};      // the kernel's receive stamp; zero if there is none
  bool hardware = false;  // the adapter has stamped it too, with its own clock
};

// Number of the interface. An Error names what is missing: CAN in the kernel, the interface, or
// the link.
Result<int> find_interface(int any_can_socket, const std::string& interface);
// Calls socket(2); the Error explains it if this kernel has no CAN.
Result<UniqueFd> open_can(int type, int protocol);
// The Error for a failed call on an open CAN socket.
Error link_error(int error_number, const std::string& interface);

class CanSocket {
 public:
  struct Options {
    std::string interface;
    std::vector<Identifier> identifiers;  // the kernel passes no others
    bool fd = false;
    bool error_frames = true;
    int receive_buffer = 8 << 20;  // bytes
  };
  static Result<CanSocket> open(const Options& options);
  CanSocket(CanSocket&&) noexcept;
  CanSocket& operator=(CanSocket&&) noexcept;
  ~CanSocket();

  // Waits at most `timeout` for a frame and takes the frames that are there, at most out.size()
  // and kBatch. An Error means that the link is down or gone.
  Result<std::size_t> receive(std::span<Received> out, Nanoseconds timeout);
  Result<void> send(const protocol::can::Frame& frame);

  // Frames that the kernel dropped because the receive queue was full, since open().
  std::uint64_t dropped() const { return dropped_; }
  // True while the name still belongs to the interface that was opened.
  bool still_there() const;
  // A sentence about a request that was not granted (the receive buffer); empty otherwise.
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
  std::uint32_t drop_counter_ = 0;  // the kernel's counter, which wraps
  std::string shortcoming_;
  std::unique_ptr<Buffers> buffers_;
};

}  // namespace shaker::drivers::can
