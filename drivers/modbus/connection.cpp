#include "drivers/modbus/connection.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include "protocol/modbus/exception.hpp"

namespace shaker::drivers::modbus {
namespace {

using namespace std::chrono_literals;
using protocol::modbus::Reaction;
using protocol::modbus::RegisterTable;

constexpr Nanoseconds kLongestBackoff = 30s;
constexpr Nanoseconds kFirstBusyPause = 2ms;
// More unread bytes are not a late answer but a flood.
constexpr std::size_t kMostStaleBytes = 64 * 1024;

int exception_code(int error) {
  const int code = error - MODBUS_ENOBASE;
  return code >= 1 && code < MODBUS_EXCEPTION_MAX ? code : 0;
}

bool makes_no_sense(int error) {
  return error >= EMBBADCRC && error <= EMBBADSLAVE;
}

}  // namespace

Result<std::unique_ptr<ModbusConnection>> ModbusConnection::make(const config::ModbusLink& link,
                                                                 Clock& clock) {
  if (const Result<void> good = validate(link); !good) return good.error();
  return std::unique_ptr<ModbusConnection>(new ModbusConnection(link, clock));
}

ModbusConnection::ModbusConnection(const config::ModbusLink& link, Clock& clock)
    : link_(link),
      clock_(clock),
      description_(describe(link)),
      timeout_(from_seconds(link.response_timeout_s)),
      serial_(std::holds_alternative<config::ModbusRtu>(link.transport)),
      tcp_(link.unit_id),
      backoff_(from_seconds(link.reconnect_s)) {}

Error ModbusConnection::error(ErrorKind kind, const std::string& text) const {
  return Error{kind, description_ + ": " + text};
}

Result<void> ModbusConnection::connect() {
  const Nanoseconds started = clock_.now();
  if (!connected()) {
    if (started < next_attempt_) {
      return error(ErrorKind::unavailable, fmt::format("not connected; next attempt in {:.1f} s",
                                                       seconds(next_attempt_ - started)));
    }
    if (const Result<void> opened = open(started); !opened) return opened;
  }
  if (clock_.now() < ready_at_) clock_.sleep_until(std::min(ready_at_, started + timeout_));
  return ready();
}

Result<void> ModbusConnection::connect_now() {
  if (!connected()) {
    if (const Result<void> opened = open(clock_.now()); !opened) return opened;
  }
  if (clock_.now() < ready_at_) clock_.sleep_until(ready_at_);
  return {};
}

Result<void> ModbusConnection::open(Nanoseconds started) {
  Result<Context> dialled = dial(link_, timeout_);
  if (!dialled) {
    next_attempt_ = std::max(started, clock_.now()) + backoff_;
    backoff_ = std::min(2 * backoff_, kLongestBackoff);
    return error(dialled.error().kind, dialled.error().what);
  }
  context_ = std::move(*dialled);
  failures_ = 0;
  silent_until_ = Nanoseconds{0};
  ready_at_ = clock_.now() + from_seconds(link_.pause_after_connect_s);
  ++counters_.connects;
  return {};
}

Result<void> ModbusConnection::ready() const {
  if (!connected()) return error(ErrorKind::unavailable, "not connected");
  const Nanoseconds now = clock_.now();
  if (now < ready_at_) {
    return error(ErrorKind::unavailable,
                 fmt::format("connected; the device wants {:.1f} s more before its first request",
                             seconds(ready_at_ - now)));
  }
  if (now < silent_until_) {
    return error(ErrorKind::timeout, "waiting for the line to fall silent after a missed answer");
  }
  return {};
}

// Closes the connection after a failure; the next attempt waits. The pause returns to its first
// length only after an answer, so that a device that accepts connections without answering is
// not flooded.
void ModbusConnection::drop() {
  close();
  next_attempt_ = clock_.now() + backoff_;
  backoff_ = std::min(2 * backoff_, kLongestBackoff);
}

void ModbusConnection::wait_for_silence() {
  if (clock_.now() < silent_until_) clock_.sleep_until(silent_until_);
}

template <class What, class Request>
Result<void> ModbusConnection::transact(const What& what, bool is_write, int frame_bytes,
                                        const Request& request) {
  if (const Result<void> good = ready(); !good) return good;
  Nanoseconds deadline = clock_.now() + timeout_;
  if (serial_) {
    // A character is 11 bits (start, 8 data, parity, stop).
    deadline +=
        from_seconds(frame_bytes * 11.0 / std::get<config::ModbusRtu>(link_.transport).baud);
  }
  for (Nanoseconds pause = kFirstBusyPause;; pause *= 2) {
    if (!drain()) {
      drop();
      return error(ErrorKind::unavailable, what() + ": the device has closed the connection");
    }
    const Nanoseconds left = std::max<Nanoseconds>(deadline - clock_.now(), 1ms);
    modbus_set_response_timeout(context_.get(), static_cast<std::uint32_t>(left / 1s),
                                static_cast<std::uint32_t>(left % 1s / 1us));
    if (request(left) >= 0) {
      failures_ = 0;
      backoff_ = from_seconds(link_.reconnect_s);
      return {};
    }
    const int trouble = errno;
    const int code = exception_code(trouble);
    if (code == 0) return failed(what(), trouble, deadline);
    failures_ = 0;  // the device is alive and understands the request
    backoff_ = from_seconds(link_.reconnect_s);
    const Reaction reaction = protocol::modbus::reaction_to(code);
    if (reaction == Reaction::accepted && is_write) return {};
    if (reaction == Reaction::give_up || clock_.now() + pause >= deadline) {
      return error(ErrorKind::refused, what() + ": " + protocol::modbus::exception_sentence(code));
    }
    clock_.sleep_until(clock_.now() + pause);
  }
}

Result<void> ModbusConnection::read(const protocol::modbus::Block& block,
                                    std::span<std::uint16_t> words) {
  const bool holding = block.table == RegisterTable::holding;
  const auto what = [&] {
    return fmt::format(
        "reading {} register{} {}", holding ? "holding" : "input", block.words == 1 ? "" : "s",
        block.words == 1 ? fmt::format("{}", block.address)
                         : fmt::format("{}..{}", block.address, block.address + block.words - 1));
  };
  return transact(what, false, 13 + 2 * block.words, [&](Nanoseconds left) {
    if (!serial_) return tcp_.read(modbus_get_socket(context_.get()), block, words, left);
    const auto request = holding ? modbus_read_registers : modbus_read_input_registers;
    return request(context_.get(), block.address, block.words, words.data());
  });
}

Result<void> ModbusConnection::write(int address, std::span<const std::uint16_t> words) {
  const int count = static_cast<int>(words.size());
  const auto what = [&] {
    return fmt::format("writing {} register{} from {}", count, count == 1 ? "" : "s", address);
  };
  return transact(what, true, 17 + 2 * count, [&](Nanoseconds left) {
    const int socket = modbus_get_socket(context_.get());
    if (count == 1 && single_writes_) {
      const int written = serial_ ? modbus_write_register(context_.get(), address, words[0])
                                  : tcp_.write_single(socket, address, words[0], left);
      if (written != -1 || errno != EMBXILFUN) return written;
      single_writes_ = false;  // some devices know only function 16
    }
    if (!serial_) return tcp_.write(socket, address, words, left);
    return modbus_write_registers(context_.get(), address, count, words.data());
  });
}

Result<void> ModbusConnection::failed(const std::string& what, int trouble, Nanoseconds deadline) {
  if (trouble == ETIMEDOUT || trouble == EAGAIN) {
    ++counters_.timeouts;
    count_failure();
    return error(ErrorKind::timeout,
                 fmt::format("{}: no answer within {:.0f} ms; check power, cable and unit id, or "
                             "raise response_timeout_s",
                             what, 1e3 * seconds(timeout_)));
  }
  if (makes_no_sense(trouble)) {
    ++counters_.malformed;
    await_rest(deadline);
    count_failure();
    if (trouble == EMBBADSLAVE && !serial_) {
      return error(
          ErrorKind::io,
          fmt::format("{}: unit {} has answered instead of unit {}; check unit_id, and the "
                      "gateway if there is one",
                      what, tcp_.answered_unit(), link_.unit_id));
    }
    return error(ErrorKind::io,
                 fmt::format("{}: the answer makes no sense ({}); check for a second device with "
                             "the same unit id, noise on the line, or a late answer",
                             what, modbus_strerror(trouble)));
  }
  drop();
  return error(ErrorKind::unavailable,
               fmt::format("{}: the connection is lost ({}); it is opened again by itself", what,
                           modbus_strerror(trouble)));
}

void ModbusConnection::count_failure() {
  if (serial_) silent_until_ = clock_.now() + timeout_;
  if (++failures_ >= link_.timeouts_before_close) drop();
}

// Discards unread bytes, which belong to an earlier request. Returns false if the other side
// has hung up or sends without a request.
bool ModbusConnection::drain() {
  if (serial_) return modbus_flush(context_.get()) >= 0;
  std::array<char, 4096> stale;
  std::size_t total = 0;
  while (total <= kMostStaleBytes) {
    const auto got =
        ::recv(modbus_get_socket(context_.get()), stale.data(), stale.size(), MSG_DONTWAIT);
    if (got == 0) return false;
    if (got < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
    total += static_cast<std::size_t>(got);
  }
  return false;
}

// The invalid answer was probably late, and the right one is on its way. Waits for it within
// this call's time, so that the next request does not receive it.
void ModbusConnection::await_rest(Nanoseconds deadline) {
  const Nanoseconds left = deadline - clock_.now();
  if (serial_ || left <= 0ns) return;
  pollfd wait{modbus_get_socket(context_.get()), POLLIN, 0};
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(left).count();
  ::poll(&wait, 1, static_cast<int>(ms));
}

}  // namespace shaker::drivers::modbus
