#include "drivers/modbus/tcp_exchange.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>

#include <modbus/modbus.h>
#include <poll.h>
#include <sys/socket.h>

namespace shaker::drivers::modbus {
namespace {

using std::chrono::steady_clock;

// Offsets in a frame: transaction 0, protocol 2, length 4, unit 6, function 7, data from 8.
constexpr std::size_t kUnit = 6, kFunction = 7, kData = 8;
constexpr int kReadHolding = 3, kReadInput = 4, kWriteSingle = 6, kWriteMany = 16;
constexpr int kException = 0x80;

int failure(int error) {
  errno = error;
  return -1;
}

bool wait_for(int fd, short what, steady_clock::time_point deadline) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - steady_clock::now());
    pollfd wait{fd, what, 0};
    const int ready = ::poll(&wait, 1, static_cast<int>(std::max<long>(0, left.count())));
    if (ready > 0) return true;
    if (ready == 0) return failure(ETIMEDOUT), false;
    if (errno != EINTR) return false;
  }
}

bool again(int error) {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

int send_all(int fd, std::span<const std::uint8_t> bytes, steady_clock::time_point deadline) {
  while (!bytes.empty()) {
    const auto sent = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && !again(errno)) return -1;
    if (sent < 0 && !wait_for(fd, POLLOUT, deadline)) return -1;
    if (sent > 0) bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return 0;
}

int receive_all(int fd, std::span<std::uint8_t> bytes, steady_clock::time_point deadline) {
  while (!bytes.empty()) {
    if (!wait_for(fd, POLLIN, deadline)) return -1;
    const auto got = ::recv(fd, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (got == 0) return failure(ECONNRESET);
    if (got < 0 && !again(errno)) return -1;
    if (got > 0) bytes = bytes.subspan(static_cast<std::size_t>(got));
    if (!bytes.empty() && steady_clock::now() >= deadline) return failure(ETIMEDOUT);
  }
  return 0;
}

}  // namespace

std::uint16_t TcpExchange::word(std::size_t at) const {
  return static_cast<std::uint16_t>(answer_[at] << 8 | answer_[at + 1]);
}

void TcpExchange::begin(int function, int address, int value) {
  ++transaction_;
  const int head[] = {
      transaction_ >> 8, transaction_ & 0xFF, 0,          0,           0, 0, unit_, function,
      address >> 8,      address & 0xFF,      value >> 8, value & 0xFF};
  size_ = 0;
  for (const int byte : head)
    request_[size_++] = static_cast<std::uint8_t>(byte);
}

int TcpExchange::exchange(int fd, std::size_t expected, Nanoseconds timeout) {
  const auto deadline = steady_clock::now() + timeout;
  request_[4] = static_cast<std::uint8_t>((size_ - kUnit) >> 8);
  request_[5] = static_cast<std::uint8_t>(size_ - kUnit);
  answer_[kUnit] = unit_;
  if (send_all(fd, std::span(request_).first(size_), deadline) != 0) return -1;
  if (receive_all(fd, std::span(answer_).first(kData), deadline) != 0) return -1;
  const std::size_t length = word(4);
  if (word(0) != transaction_ || word(2) != 0 || length < 3 || kUnit + length > kMostBytes) {
    return failure(EMBBADDATA);
  }
  if (receive_all(fd, std::span(answer_).subspan(kData, length - 2), deadline) != 0) return -1;
  if (answer_[kUnit] != unit_) return failure(EMBBADSLAVE);
  if (answer_[kFunction] == (request_[kFunction] | kException)) {
    const int code = answer_[kData];
    return failure(length == 3 && code >= 1 && code < MODBUS_EXCEPTION_MAX ? MODBUS_ENOBASE + code
                                                                           : EMBBADEXC);
  }
  if (answer_[kFunction] != request_[kFunction] || length != 2 + expected) {
    return failure(EMBBADDATA);
  }
  return 0;
}

int TcpExchange::read(int fd, const protocol::modbus::Block& block, std::span<std::uint16_t> words,
                      Nanoseconds timeout) {
  const bool holding = block.table == protocol::modbus::RegisterTable::holding;
  begin(holding ? kReadHolding : kReadInput, block.address, block.words);
  const std::size_t bytes = 2 * words.size();
  if (exchange(fd, 1 + bytes, timeout) != 0) return -1;
  if (answer_[kData] != bytes) return failure(EMBBADDATA);
  for (std::size_t i = 0; i < words.size(); ++i)
    words[i] = word(kData + 1 + 2 * i);
  return 0;
}

// Does not compare the echoed value: a caller that must know what the device holds reads it
// back.
int TcpExchange::write_single(int fd, int address, std::uint16_t value, Nanoseconds timeout) {
  begin(kWriteSingle, address, value);
  if (exchange(fd, 4, timeout) != 0) return -1;
  return word(kData) == address ? 0 : failure(EMBBADDATA);
}

int TcpExchange::write(int fd, int address, std::span<const std::uint16_t> words,
                       Nanoseconds timeout) {
  begin(kWriteMany, address, static_cast<int>(words.size()));
  request_[size_++] = static_cast<std::uint8_t>(2 * words.size());
  for (const std::uint16_t value : words) {
    request_[size_++] = static_cast<std::uint8_t>(value >> 8);
    request_[size_++] = static_cast<std::uint8_t>(value);
  }
  if (exchange(fd, 4, timeout) != 0) return -1;
  return word(kData) == address && word(kData + 2) == words.size() ? 0 : failure(EMBBADDATA);
}

}  // namespace shaker::drivers::modbus
