// What waits for the broker: the newest document of each kind, and every alarm up to a bound.
//
// A document gets its age when it is handed over, not when it came, so that one that has waited
// says so. What the broker has not confirmed when a connection ends waits again. On a new
// connection the newest of each kind is handed over once more, since a broker that has been
// started anew may have forgotten what it retained. Pure: no sockets, no clocks. One thread.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "mqtt/topics.hpp"

namespace shaker::mqtt {

struct Document {
  std::string text;    // a JSON object with at least one member, as it is published but for ages
  Nanoseconds made{};  // when, on CLOCK_MONOTONIC
};

// What is to be published now.
struct Handover {
  std::uint64_t ticket = 0;  // for confirmed()
  Kind kind = Kind::bridge;
  std::string payload;
};

// Alarms beyond either number are dropped, the oldest first.
struct AlarmBound {
  std::size_t count = 1000, bytes = 4 * 1024 * 1024;
};

class Outbox {
 public:
  // As many wait for the broker's confirmation at a time. A broker that does not confirm gets no
  // more than these.
  static constexpr std::size_t kMaxUnconfirmed = 10;

  explicit Outbox(AlarmBound bound = {}) : bound_(bound) {}

  // What `bridge` says from now on: a word, not a document.
  void say(std::string word);
  // Of an alarm: it joins those that wait. Of any other kind: it replaces the one before.
  void put(Kind kind, Document document);

  // A connection to the broker begins.
  void begin_connection();
  // What is to be handed over next; nothing while enough is unconfirmed, or if nothing waits.
  // `now` is on CLOCK_MONOTONIC.
  std::optional<Handover> next(Nanoseconds now);
  void confirmed(std::uint64_t ticket);

  bool delivered(Kind kind) const;  // the newest of this kind is confirmed
  std::size_t alarms_waiting() const { return alarms_.size(); }
  std::uint64_t alarms_dropped() const { return dropped_; }

 private:
  struct Newest {
    std::optional<Document> document;
    bool waits = false, confirmed = false;
    std::uint64_t ticket = 0;
  };
  struct Alarm {
    Document document;
    std::uint64_t dropped_before = 0, ticket = 0;
  };
  Newest& newest(Kind kind) { return newest_[index_of(kind)]; }
  void keep_the_bound();
  Handover hand_over(Kind kind, const Document& document, Nanoseconds now, std::string more = {});
  std::string ages(Nanoseconds now) const;

  AlarmBound bound_;
  std::array<Newest, kKindNames.size()> newest_;
  std::deque<Alarm> alarms_;
  std::size_t alarm_bytes_ = 0;
  std::uint64_t dropped_ = 0, last_ticket_ = 0;
  std::map<std::uint64_t, Kind> unconfirmed_;
};

}  // namespace shaker::mqtt
