// One Modbus device on its wire, TCP or RTU: registers in, registers out, and never stuck.
//
// Around libmodbus for serial lines (its own recovery can loop for ever, and a single late answer
// desynchronises it for good) and TcpExchange for TCP. Here every request starts on a drained line,
// waits at most the response timeout (on a serial line plus the time that its frames take), and
// after some failures in a row the connection is closed and re-opened with pauses that double from
// reconnect_s up to 30 s.
//
// One object, one thread. Only `connect_now` and `wait_for_silence` wait longer than one timeout.
// An Error begins with the device's description; its kind says what happened:
//   timeout      no answer in time            refused  a Modbus exception, with its sentence
//   io           an answer that makes no sense  unavailable  no connection: call connect() again
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "config/rig.hpp"
#include "drivers/modbus/dial.hpp"
#include "drivers/modbus/tcp_exchange.hpp"
#include "protocol/modbus/block.hpp"

namespace shaker::drivers::modbus {

struct ConnectionCounters {
  std::uint64_t connects = 0;  // successful ones
  std::uint64_t timeouts = 0;
  std::uint64_t malformed = 0;  // answers that make no sense
};

class ModbusConnection {
 public:
  // Opens nothing yet. An Error names the setting that is wrong.
  static Result<std::unique_ptr<ModbusConnection>> make(const config::ModbusLink& link,
                                                        Clock& clock);

  const std::string& description() const { return description_; }
  bool connected() const { return context_ != nullptr; }
  const ConnectionCounters& counters() const { return counters_; }
  Nanoseconds response_timeout() const { return timeout_; }

  // Connects unless connected. While a back-off pause or the device's pause after connecting runs,
  // an `unavailable` Error comes back at once: call again later.
  Result<void> connect();
  // Without regard to the back-off, and waits for the device's pause: for a stop.
  Result<void> connect_now();
  void close() { context_.reset(); }

  // Precondition: words.size() == block.words, at most 125.
  Result<void> read(const protocol::modbus::Block& block, std::span<std::uint16_t> words);
  // One request for all words (at most 123), so that a 32-bit value is never written by halves.
  Result<void> write(int address, std::span<const std::uint16_t> words);

  // After a missed answer on a serial line, requests are refused for one more timeout, so that a
  // late answer (which RTU cannot tell from the right one) is not taken for the next one's.
  void wait_for_silence();
  void break_silence() { silent_until_ = Nanoseconds{0}; }

 private:
  ModbusConnection(const config::ModbusLink& link, Clock& clock);

  Result<void> open(Nanoseconds started);
  Result<void> ready() const;
  // `what` makes the words of an Error, only when there is one; `request` is libmodbus' call.
  // It gets the time that is left.
  template <class What, class Request>
  Result<void> transact(const What& what, bool is_write, int frame_bytes, const Request& request);
  Result<void> failed(const std::string& what, int error, Nanoseconds deadline);
  bool drain();
  void await_rest(Nanoseconds deadline);
  void count_failure();
  void drop();
  Error error(ErrorKind kind, const std::string& text) const;

  config::ModbusLink link_;
  Clock& clock_;
  Context context_;  // none while not connected
  std::string description_;
  Nanoseconds timeout_;
  bool serial_;
  TcpExchange tcp_;
  bool single_writes_ = true;  // function 06 is known
  int failures_ = 0;           // in a row
  Nanoseconds backoff_;
  Nanoseconds next_attempt_{0}, ready_at_{0}, silent_until_{0};
  ConnectionCounters counters_;
};

}  // namespace shaker::drivers::modbus
