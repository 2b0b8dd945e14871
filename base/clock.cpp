#include "base/clock.hpp"

#include <cerrno>
#include <ctime>

#include <fmt/format.h>

namespace shaker {
namespace {

Nanoseconds read(clockid_t id) {
  timespec t{};
  clock_gettime(id, &t);
  return std::chrono::seconds(t.tv_sec) + Nanoseconds(t.tv_nsec);
}

}  // namespace

Nanoseconds RealClock::now() const {
  return read(CLOCK_MONOTONIC);
}
Nanoseconds RealClock::utc() const {
  return read(CLOCK_REALTIME);
}

void RealClock::sleep_until(Nanoseconds monotonic) {
  timespec t{};
  t.tv_sec = monotonic.count() / 1'000'000'000;
  t.tv_nsec = monotonic.count() % 1'000'000'000;
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

std::string format_utc(Nanoseconds utc) {
  const std::time_t whole = utc.count() / 1'000'000'000;
  const auto milliseconds = utc.count() / 1'000'000 % 1000;
  std::tm parts{};
  gmtime_r(&whole, &parts);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", parts.tm_year + 1900,
                     parts.tm_mon + 1, parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec,
                     milliseconds);
}

}  // namespace shaker
