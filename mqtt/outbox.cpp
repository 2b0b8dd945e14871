#include "mqtt/outbox.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace shaker::mqtt {
namespace {

double age_s(const Document& document, Nanoseconds now) {
  return std::max(0.0, seconds(now - document.made));
}

// The text of an object with further members: `{"a":1}` and `,"b":2` make `{"a":1,"b":2}`.
std::string with_members(const std::string& object, const std::string& members) {
  return object.substr(0, object.rfind('}')) + members + "}";
}

}  // namespace

void Outbox::say(std::string word) {
  newest(Kind::bridge) = {Document{std::move(word), {}}, true};
}

void Outbox::put(Kind kind, Document document) {
  if (kind == Kind::alarm) {
    alarm_bytes_ += document.text.size();
    alarms_.push_back({document});
    // It takes its turn in the queue.
    newest(kind) = {std::move(document), false};
    keep_the_bound();
  } else {
    newest(kind) = {std::move(document), true};
  }
}

// Leaves those that have been handed over, and the newest one.
void Outbox::keep_the_bound() {
  while (alarms_.size() > bound_.count || alarm_bytes_ > bound_.bytes) {
    const auto oldest =
        std::ranges::find_if(alarms_, [](const Alarm& alarm) { return alarm.ticket == 0; });
    if (oldest == alarms_.end() || std::next(oldest) == alarms_.end()) return;
    std::next(oldest)->dropped_before += oldest->dropped_before + 1;
    alarm_bytes_ -= oldest->document.text.size();
    alarms_.erase(oldest);
    ++dropped_;
  }
}

void Outbox::begin_connection() {
  unconfirmed_.clear();
  for (Alarm& alarm : alarms_)
    alarm.ticket = 0;
  for (Newest& one : newest_) {
    one.waits = one.document.has_value();
    one.confirmed = false;
    one.ticket = 0;
  }
  if (!alarms_.empty()) newest(Kind::alarm).waits = false;
}

std::optional<Handover> Outbox::next(Nanoseconds now) {
  if (unconfirmed_.size() >= kMaxUnconfirmed) return std::nullopt;
  for (std::size_t i = 0; i < newest_.size(); ++i) {
    const Kind kind = static_cast<Kind>(i);
    if (kind == Kind::alarm) {
      const auto first = std::ranges::find(alarms_, 0U, &Alarm::ticket);
      if (first != alarms_.end()) {
        Handover handover = hand_over(
            kind, first->document, now,
            first->dropped_before > 0 ? fmt::format(",\"dropped_before\":{}", first->dropped_before)
                                      : std::string());
        first->ticket = handover.ticket;
        if (std::next(first) == alarms_.end()) newest(kind).ticket = handover.ticket;
        return handover;
      }
    }
    if (!newest_[i].waits) continue;
    Handover handover = hand_over(kind, *newest_[i].document, now);
    newest_[i].waits = false;
    newest_[i].ticket = handover.ticket;
    return handover;
  }
  return std::nullopt;
}

Handover Outbox::hand_over(Kind kind, const Document& document, Nanoseconds now, std::string more) {
  unconfirmed_[++last_ticket_] = kind;
  if (kind == Kind::bridge) return {last_ticket_, kind, document.text};
  more += fmt::format(",\"age_s\":{:.3f}", age_s(document, now));
  if (kind == Kind::health) more += ages(now);
  return {last_ticket_, kind, with_members(document.text, more)};
}

std::string Outbox::ages(Nanoseconds now) const {
  std::string inside;
  for (const Kind kind : kDocumentKinds) {
    const auto& document = newest_[index_of(kind)].document;
    if (kind == Kind::health || !document) continue;
    inside += fmt::format("{}\"{}\":{:.3f}", inside.empty() ? "" : ",", kKindNames[index_of(kind)],
                          age_s(*document, now));
  }
  return ",\"ages_s\":{" + inside + "}";
}

void Outbox::confirmed(std::uint64_t ticket) {
  const auto found = unconfirmed_.find(ticket);
  if (found == unconfirmed_.end()) return;
  Newest& one = newest(found->second);
  if (one.ticket == ticket) one.confirmed = true;
  unconfirmed_.erase(found);
  const auto alarm = std::ranges::find(alarms_, ticket, &Alarm::ticket);
  if (alarm == alarms_.end()) return;
  alarm_bytes_ -= alarm->document.text.size();
  alarms_.erase(alarm);
}

bool Outbox::delivered(Kind kind) const {
  return newest_[index_of(kind)].confirmed;
}

}  // namespace shaker::mqtt
