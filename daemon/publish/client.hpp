// One connection: converts received bytes to lines and lines to sent bytes. Never blocks.
//
// One call of `receive` takes at most 4 KiB and four lines, so that no client delays the
// others. The rest stays in the kernel's buffer. The loop then finds the connection ready
// again, and a client that sends faster than it is served has to wait.
//
// A client that reads too slowly is condemned: lines of which nothing was sent are withdrawn
// and counted, one line {"type":"missed","count":N} reports them, and the connection is closed.
// The server never waits for a client.
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
  int client = 0;          // number of the connection, from 1
  std::string who;         // for messages: "anna (pid 4711)"
  bool read_only = false;  // TCP: may listen, not command
};

// Limits for one client in one turn of the loop.
inline constexpr std::size_t kMaxReadPerTurn = 4096;  // bytes
inline constexpr int kMaxLinesPerTurn = 4;
// No further requests are read while more bytes of answers than this are waiting.
inline constexpr std::size_t kMaxUnreadAnswers = 64 * 1024;

class Client {
 public:
  Client(UniqueFd fd, Peer peer, std::size_t max_queued);

  int fd() const { return fd_.get(); }
  const Peer& peer() const { return peer_; }

  // --- in
  struct Input {
    std::vector<std::string> lines;
    int too_long = 0;      // lines above the limit, discarded up to their newline
    bool ended = false;    // the other side sends no more
    bool nothing = false;  // nothing has arrived since the last call
  };
  Input receive();
  // True if the client reads its answers, so that further requests may be read.
  bool reads_answers() const { return answer_bytes_ <= kMaxUnreadAnswers; }

  // --- out
  enum class Kind : std::uint8_t { document, answer };
  void send(const Line& line, Nanoseconds now, Kind kind = Kind::document);
  // True if so much waits for it that what it can do without is left out.
  bool lags() const { return queued_bytes_ > kMaxUnreadAnswers; }
  // Sends as much as the kernel takes. Returns false if the connection is to be closed: it is
  // broken, or the missed lines were reported.
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
  bool skipping_ = false;  // the rest of a line that is too long
  struct Queued {
    Line line;
    Kind kind = Kind::document;
  };
  std::deque<Queued> queue_;
  // `answer_bytes_` counts those of `queued_bytes_` that belong to unsent answers.
  std::size_t sent_of_first_ = 0, queued_bytes_ = 0, answer_bytes_ = 0, max_queued_;
  std::optional<Nanoseconds> condemned_since_;
  std::uint64_t missed_ = 0;
  bool told_ = false;
};

}  // namespace shaker::daemon
