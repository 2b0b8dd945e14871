#include "daemon/publish/client.hpp"

#include <array>
#include <cerrno>

#include <fmt/format.h>
#include <sys/socket.h>

#include "protocol/rpc.hpp"

namespace shaker::daemon {
namespace {

// Number of bytes that one turn takes.
std::size_t size_of_turn(std::string_view bytes) {
  std::size_t end = 0;
  for (int line = 0; line < kMaxLinesPerTurn; ++line) {
    const auto newline = bytes.find('\n', end);
    if (newline == std::string_view::npos) return bytes.size();
    end = newline + 1;
  }
  return end;
}

}  // namespace

Client::Client(UniqueFd fd, Peer peer, std::size_t max_queued)
    : fd_(std::move(fd)), peer_(std::move(peer)), max_queued_(max_queued) {}

Client::Input Client::receive() {
  Input input;
  std::array<char, kMaxReadPerTurn> buffer;
  ssize_t got = ::recv(fd_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT | MSG_PEEK);
  if (got > 0) {
    const auto turn = size_of_turn({buffer.data(), static_cast<std::size_t>(got)});
    got = ::recv(fd_.get(), buffer.data(), turn, MSG_DONTWAIT);
  }
  if (got <= 0) {
    input.ended = got == 0 || (errno != EAGAIN && errno != EINTR);
    input.nothing = !input.ended;
    return input;
  }
  std::string_view rest(buffer.data(), static_cast<std::size_t>(got));
  while (!rest.empty()) {
    const auto newline = rest.find('\n');
    const auto part = rest.substr(0, newline);
    if (!skipping_) in_ += part;
    if (in_.size() > protocol::kMaxRequestLine) {
      ++input.too_long;
      in_.clear();
      skipping_ = true;
    }
    if (newline == std::string_view::npos) break;
    if (!skipping_ && !in_.empty()) input.lines.push_back(std::move(in_));
    in_.clear();
    skipping_ = false;
    rest.remove_prefix(newline + 1);
  }
  return input;
}

void Client::send(const Line& line, Nanoseconds now, Kind kind) {
  if (condemned_since_) {
    if (!told_) ++missed_;
    return;
  }
  queue_.push_back({line, kind});
  queued_bytes_ += line->size();
  if (kind == Kind::answer) answer_bytes_ += line->size();
  if (queued_bytes_ > max_queued_) condemn(now);
}

void Client::condemn(Nanoseconds now) {
  condemned_since_ = now;
  const std::size_t begun = sent_of_first_ > 0 ? 1 : 0;  // a line that was begun is completed
  missed_ += queue_.size() - begun;
  queue_.resize(begun);
  queued_bytes_ = begun != 0 ? queue_.front().line->size() - sent_of_first_ : 0;
  answer_bytes_ = 0;
  if (begun != 0) queue_.front().kind = Kind::document;  // no longer counted as an answer
}

void Client::forget_first() {
  const Queued& first = queue_.front();
  if (first.kind == Kind::answer) answer_bytes_ -= first.line->size();
  queue_.pop_front();
  sent_of_first_ = 0;
}

// The line was not begun, so lines that are missed from now on are counted in it too.
void Client::withdraw_last_line() {
  queued_bytes_ -= queue_.back().line->size();
  queue_.pop_back();
  told_ = false;
}

bool Client::flush() {
  while (true) {
    if (queue_.empty() && condemned_since_ && !told_) {
      told_ = true;
      queue_.push_back({std::make_shared<const std::string>(
                            fmt::format("{{\"type\":\"missed\",\"count\":{}}}\n", missed_)),
                        Kind::document});
      queued_bytes_ += queue_.back().line->size();
    }
    if (queue_.empty()) return !told_;
    const std::string& first = *queue_.front().line;
    const ssize_t sent = ::send(fd_.get(), first.data() + sent_of_first_,
                                first.size() - sent_of_first_, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0) {
      const bool later = errno == EAGAIN || errno == EINTR;
      if (later && told_ && sent_of_first_ == 0) withdraw_last_line();
      return later;
    }
    sent_of_first_ += static_cast<std::size_t>(sent);
    queued_bytes_ -= static_cast<std::size_t>(sent);
    if (sent_of_first_ < first.size()) continue;
    forget_first();
  }
}

}  // namespace shaker::daemon
