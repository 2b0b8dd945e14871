#include "drivers/can/stamps.hpp"

#include <algorithm>

namespace shaker::drivers::can {
namespace {

// A preemption between two clock readings must not look like a step of the wall clock.
constexpr Nanoseconds kSlack = std::chrono::milliseconds(1);

}  // namespace

ClockPair read_pair(const Clock& clock) {
  ClockPair best;
  Nanoseconds tightest = Nanoseconds::max();
  for (int i = 0; i < 3; ++i) {
    const auto before = clock.now();
    const auto utc = clock.utc();
    const auto width = clock.now() - before;
    if (width < tightest) {
      tightest = width;
      best = {before + width / 2, utc};
    }
  }
  return best;
}

void StampConverter::restart(ClockPair now) {
  previous_ = current_ = now;
  newest_ = now.monotonic;
}

void StampConverter::update(ClockPair now) {
  previous_ = current_;
  current_ = now;
}

Nanoseconds StampConverter::convert(Nanoseconds utc) {
  const auto accept = [&](Nanoseconds t) {
    newest_ = std::max(newest_, std::min(t, current_.monotonic));
    return newest_;
  };
  if (utc.count() != 0) {
    for (const ClockPair& pair : {current_, previous_}) {
      const auto t = utc - pair.utc + pair.monotonic;
      if (t >= newest_ - kSlack && t <= current_.monotonic + kSlack) return accept(t);
    }
  }
  ++replaced_;
  return accept(current_.monotonic);
}

}  // namespace shaker::drivers::can
