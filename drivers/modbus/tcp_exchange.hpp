// One request and its answer on a Modbus TCP connection: nothing but the answer is believed.
//
// libmodbus takes an answer from any unit behind the same address, so its TCP exchange is not used.
// Here transaction, protocol, length, unit, function, address and counts must be those of the
// request. The whole answer must be there in the time given, however slowly its bytes come.
//
// Both calls return 0, or -1 with an errno as libmodbus sets it: MODBUS_ENOBASE plus the code of an
// exception, EMBBADSLAVE, EMBBADDATA, EMBBADEXC, ETIMEDOUT, or why the connection is lost.
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

  // `fd` is a connected socket that does not block.
  int read(int fd, const protocol::modbus::Block& block, std::span<std::uint16_t> words,
           Nanoseconds timeout);
  int write_single(int fd, int address, std::uint16_t word, Nanoseconds timeout);
  int write(int fd, int address, std::span<const std::uint16_t> words, Nanoseconds timeout);

  // Of the last answer, wrong or right.
  int answered_unit() const { return answer_[6]; }

 private:
  static constexpr std::size_t kMostBytes = 260;  // of a frame

  void begin(int function, int address, int value);
  // Sends the request; the answer's data behind the function code must be `expected` bytes.
  int exchange(int fd, std::size_t expected, Nanoseconds timeout);
  std::uint16_t word(std::size_t at) const;

  std::uint8_t unit_;
  std::uint16_t transaction_ = 0;
  std::size_t size_ = 0;  // of the request
  std::array<std::uint8_t, kMostBytes> request_{}, answer_{};
};

}  // namespace shaker::drivers::modbus
