#include "daemon/publish/lease.hpp"

namespace shaker::daemon {

bool Lease::acquire(int client, Nanoseconds now) {
  if (holder_ && holder_ != client) return false;
  holder_ = client;
  until_ = now + duration_;
  return true;
}

void Lease::renew(int client, Nanoseconds now) {
  if (held_by(client)) until_ = now + duration_;
}

bool Lease::release(int client) {
  if (!held_by(client)) return false;
  holder_.reset();
  return true;
}

std::optional<int> Lease::expire(Nanoseconds now) {
  if (!holder_ || now < until_) return std::nullopt;
  const int lost = *holder_;
  holder_.reset();
  return lost;
}

}  // namespace shaker::daemon
