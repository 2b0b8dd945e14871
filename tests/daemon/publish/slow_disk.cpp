#include "slow_disk.hpp"

#include <atomic>
#include <chrono>
#include <thread>

#include <sys/syscall.h>
#include <unistd.h>

namespace {

std::atomic<bool> hangs{false};

void wait_for_the_disk() {
  while (hangs)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

}  // namespace

namespace shaker::daemon::testing {

void hang_the_disk(bool hang) {
  hangs = hang;
}

}  // namespace shaker::daemon::testing

// These replace the functions of the C library in the whole program, also for SQLite.
extern "C" int fsync(int fd) {
  wait_for_the_disk();
  return static_cast<int>(::syscall(SYS_fsync, fd));
}
extern "C" int fdatasync(int fd) {
  wait_for_the_disk();
  return static_cast<int>(::syscall(SYS_fdatasync, fd));
}
