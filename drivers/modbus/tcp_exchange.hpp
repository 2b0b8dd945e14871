// One request and its answer on a Modbus TCP connection, with a strict check of the answer.
//
// libmodbus accepts an answer from any unit at the same address, so its TCP exchange is not
// used. Here transaction, protocol, length, unit, function, address and counts must match the
// request. The whole answer must arrive within the timeout, however slow its bytes are.
//
// All calls return 0, or -1 with an errno as libmodbus sets it: MODBUS_ENOBASE plus the code of
// an exception, EMBBADSLAVE, EMBBADDATA, EMBBADEXC, ETIMEDOUT, or the reason for a lost
// connection.
//
// Source: MODBUS Messaging on TCP/IP Implementation Guide V1.0b (header), MODBUS Application
// Protocol V1.1b3 (functions 3, 4, 6, 16). One thread; does not allocate.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/clock.hpp"
#include "protocol/modbus/block.hpp"

namespace shaker::drivers::modbus {

class TcpExchange {
 public:
  explicit TcpExchange(int unit) : unit_(static_cast<std::uint8_t>(unit)) {}

  // `fd` is a connected, non-blocking socket.
  int read(int fd, const protocol::modbus::Block& block, std::span<std::uint16_t> words,
           Nanoseconds timeout);
  int write_single(int fd, int address, std::uint16_t word, Nanoseconds timeout);
  int write(int fd, int address, std::span<const std::uint16_t> words, Nanoseconds timeout);

  // Unit of the last answer, valid or not.
  int answered_unit() const { return answer_[6]; }

 private:
  static constexpr std::size_t kMostBytes = 260;  // of a frame

  void begin(int function, int address, int value);
  // Sends the request. The answer must have `expected` bytes of data after the function code.
  int exchange(int fd, std::size_t expected, Nanoseconds timeout);
  std::uint16_t word(std::size_t at) const;

  std::uint8_t unit_;
  std::uint16_t transaction_ = 0;
  std::size_t size_ = 0;  // of the request
  std::array<std::uint8_t, kMostBytes> request_{}, answer_{};
};

}  // namespace shaker::drivers::modbus
