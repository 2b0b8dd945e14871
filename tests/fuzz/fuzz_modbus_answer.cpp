// Any answer of a Modbus TCP device: it is accepted only when every byte of its header matches
// the request. The first byte of the input chooses request and size; the rest is the answer.
#include <array>
#include <cerrno>
#include <cstdlib>

#include <modbus/modbus.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/modbus/tcp_exchange.hpp"
#include "tests/fuzz/target.hpp"

using shaker::protocol::modbus::RegisterTable;

namespace {

constexpr int kUnit = 17, kAddress = 0x0102;
constexpr std::uint16_t kUntouched = 0xA5A5;

bool known(int error) {
  return error == ECONNRESET || error == ETIMEDOUT || error == EMBBADDATA || error == EMBBADSLAVE ||
         error == EMBBADEXC || (error > MODBUS_ENOBASE && error < MODBUS_ENOBASE + 12);
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0 || size > 4096) return 0;
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends.data()) != 0) {
    std::abort();
  }
  if (::send(ends[1], data + 1, size - 1, MSG_NOSIGNAL) != static_cast<ssize_t>(size - 1)) {
    std::abort();
  }
  ::shutdown(ends[1], SHUT_WR);  // so that the reader does not wait

  const int kind = data[0] % 4;
  const std::size_t count = kind == 2 ? 1 : 1 + data[0] / 4 % 8;
  std::array<std::uint16_t, 8> buffer;
  buffer.fill(kUntouched);
  const auto words = std::span(buffer).first(count);
  shaker::drivers::modbus::TcpExchange exchange(kUnit);
  const shaker::Nanoseconds patience = std::chrono::seconds(5);
  const int n = static_cast<int>(count);
  int done = -1;
  if (kind == 0)
    done = exchange.read(ends[0], {RegisterTable::holding, kAddress, n}, words, patience);
  if (kind == 1)
    done = exchange.read(ends[0], {RegisterTable::input, kAddress, n}, words, patience);
  if (kind == 2) done = exchange.write_single(ends[0], kAddress, 7, patience);
  if (kind == 3) done = exchange.write(ends[0], kAddress, words, patience);
  const int trouble = errno;
  ::close(ends[0]);
  ::close(ends[1]);

  if (done != 0) {
    if (!known(trouble)) std::abort();
    for (const std::uint16_t word : buffer)
      if (word != kUntouched) std::abort();
    return 0;
  }
  constexpr std::array<std::uint8_t, 4> kFunctions{3, 4, 6, 16};
  const std::uint8_t* answer = data + 1;
  const std::size_t length = kind < 2 ? 3 + 2 * count : 6;
  if (size - 1 < 6 + length) std::abort();
  const std::array<std::uint8_t, 8> head{0,     1,
                                         0,     0,
                                         0,     static_cast<std::uint8_t>(length),
                                         kUnit, kFunctions[static_cast<std::size_t>(kind)]};
  for (std::size_t i = 0; i < head.size(); ++i)
    if (answer[i] != head[i]) std::abort();
  if (kind >= 2) return answer[8] == 1 && answer[9] == 2 ? 0 : (std::abort(), 0);
  for (std::size_t i = 0; i < count; ++i)
    if (words[i] != (answer[9 + 2 * i] << 8 | answer[10 + 2 * i])) std::abort();
  return 0;
}
