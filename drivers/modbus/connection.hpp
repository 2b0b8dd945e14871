// One Modbus device on TCP or RTU: reads and writes registers in bounded time.
//
// Uses libmodbus for serial lines and TcpExchange for TCP. (The recovery of libmodbus can loop
// for ever, and a single late answer desynchronises it permanently.) Every request starts on a
// drained line and waits at most the response timeout, on a serial line plus the transfer time
// of its frames. After some failures in a row the connection is closed and opened again, with
// pauses that double from reconnect_s up to 30 s.
//
// One object, one thread. Only `connect_now` and `wait_for_silence` wait longer than one
// timeout. An Error begins with the device's description; its kind classifies the failure:
//   timeout      no answer in time            refused  a Modbus exception, with its sentence
//   io           an invalid answer            unavailable  no connection: call connect() again
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
  std::uint64_t malformed = 0;  // invalid answers
};

class ModbusConnection {
 public:
  // Does not connect. An Error names the invalid setting.
  static Result<std::unique_ptr<ModbusConnection>> make(const config::ModbusLink& link,
                                                        Clock& clock);

  const std::string& description() const { return description_; }
  bool connected() const { return context_ != nullptr; }
  const ConnectionCounters& counters() const { return counters_; }
  Nanoseconds response_timeout() const { return timeout_; }

  // Connects unless connected. During a back-off pause, or the device's pause after connecting,
  // returns an `unavailable` Error at once or after one timeout: call again later.
  Result<void> connect();
  // Ignores the back-off and waits for the device's pause; for a stop.
  Result<void> connect_now();
  void close() { context_.reset(); }

  // Precondition: words.size() == block.words, at most 125.
  Result<void> read(const protocol::modbus::Block& block, std::span<std::uint16_t> words);
  // Writes all words (at most 123) in one request, so that a 32-bit value is never written in
  // halves.
  Result<void> write(int address, std::span<const std::uint16_t> words);

  // After a missed answer on a serial line, requests are refused for one more timeout. RTU
  // cannot distinguish a late answer from the right one, so it must not meet the next request.
  void wait_for_silence();
  void break_silence() { silent_until_ = Nanoseconds{0}; }

 private:
  ModbusConnection(const config::ModbusLink& link, Clock& clock);

  Result<void> open(Nanoseconds started);
  Result<void> ready() const;
  // `what` returns the text for an Error and is called only for one. `request` performs the
  // exchange and receives the remaining time.
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
  Context context_;  // null while not connected
  std::string description_;
  Nanoseconds timeout_;
  bool serial_;
  TcpExchange tcp_;
  bool single_writes_ = true;  // the device knows function 06
  int failures_ = 0;           // in a row
  Nanoseconds backoff_;
  Nanoseconds next_attempt_{0}, ready_at_{0}, silent_until_{0};
  ConnectionCounters counters_;
};

}  // namespace shaker::drivers::modbus
