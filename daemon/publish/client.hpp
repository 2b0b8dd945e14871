// One connection: bytes in to lines, lines out to bytes. Never blocks.
//
// One call of `receive` takes a few KiB and a few lines at most, so that no client keeps the others
// waiting. What is left stays in the kernel's buffer, so that the loop finds the connection ready
// again and a client that sends faster than it is served waits by itself.
//
// A client that reads too slowly is condemned: what it had not begun to get is withdrawn and
// counted, one line {"type":"missed","count":N} tells it so, and it is closed. It is never waited
// for.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.hpp"
#include "base/unique_fd.hpp"

namespace shaker::daemon {

using Line = std::shared_ptr<const std::string>;  // with its newline; shared by all clients

struct Peer {
  int client = 0;          // counts connections, from 1
  std::string who;         // for people: "anna (pid 4711)"
  bool read_only = false;  // TCP: may listen, not command
};

// Of one client in one turn of the loop.
inline constexpr std::size_t kMaxReadPerTurn = 4096;  // bytes
inline constexpr int kMaxLinesPerTurn = 4;
// With more bytes of answers than this waiting, no more requests are read.
inline constexpr std::size_t kMaxUnreadAnswers = 64 * 1024;

class Client {
 public:
  Client(UniqueFd fd, Peer peer, std::size_t max_queued);

  int fd() const { return fd_.get(); }
  const Peer& peer() const { return peer_; }

  // --- in
  struct Input {
    std::vector<std::string> lines;
    int too_long = 0;      // lines above the limit, thrown away up to their newline
    bool ended = false;    // the other side will send no more
    bool nothing = false;  // has come since the last call
  };
  Input receive();
  // Whether its answers are read, so that more requests may be.
  bool reads_answers() const { return answer_bytes_ <= kMaxUnreadAnswers; }

  // --- out
  enum class Kind : std::uint8_t { document, answer };
  void send(const Line& line, Nanoseconds now, Kind kind = Kind::document);
  // As much as the kernel takes. False: the connection is to be closed (broken, or told and done).
  bool flush();
  bool wants_to_write() const { return !queue_.empty() || condemned_since_.has_value(); }
  std::optional<Nanoseconds> condemned_since() const { return condemned_since_; }
  std::uint64_t missed() const { return missed_; }

 private:
  void condemn(Nanoseconds now);
  void forget_first();
  void withdraw_last_line();

  UniqueFd fd_;
  Peer peer_;
  std::string in_;
  bool skipping_ = false;  // the rest of a line that was too long
  struct Queued {
    Line line;
    Kind kind = Kind::document;
  };
  std::deque<Queued> queue_;
  // Of `queued_bytes_`, `answer_bytes_` are of answers not sent to their ends.
  std::size_t sent_of_first_ = 0, queued_bytes_ = 0, answer_bytes_ = 0, max_queued_;
  std::optional<Nanoseconds> condemned_since_;
  std::uint64_t missed_ = 0;
  bool told_ = false;
};

}  // namespace shaker::daemon
