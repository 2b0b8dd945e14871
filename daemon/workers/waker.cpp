#include "daemon/workers/waker.hpp"

#include <cerrno>
#include <cstdint>

#include <sys/eventfd.h>
#include <system_error>
#include <unistd.h>

namespace shaker::daemon {

Waker::Waker() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (!fd_.valid()) throw std::system_error(errno, std::generic_category(), "eventfd");
}

void Waker::wake() noexcept {
  if (awake_.exchange(true)) return;
  const std::uint64_t one = 1;
  // Cannot fail: the counter is far from full, as it is written once for each clear.
  [[maybe_unused]] const auto written = ::write(fd_.get(), &one, sizeof one);
}

void Waker::clear() noexcept {
  std::uint64_t count = 0;
  [[maybe_unused]] const auto read = ::read(fd_.get(), &count, sizeof count);
  awake_.store(false);  // after the read: a wake from here on writes again
}

}  // namespace shaker::daemon
