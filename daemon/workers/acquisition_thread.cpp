#include "daemon/workers/acquisition_thread.hpp"

#include <algorithm>
#include <exception>

#include "daemon/workers/thread_name.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kBatch = 1024;    // samples in one read, at most
constexpr std::size_t kMaxErrors = 16;  // kept while the engine is busy

}  // namespace

AcquisitionThread::AcquisitionThread(std::unique_ptr<drivers::Sensor> sensor, Clock& clock,
                                     Waker& waker, AcquisitionOptions options)
    : sensor_(std::move(sensor)),
      clock_(clock),
      waker_(waker),
      options_(options),
      ring_(options.ring),
      view_ring_(options.view_ring),
      buffer_(kBatch),
      progress_(clock.now().count()),
      stamps_(sensor_->stamp_source()),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

AcquisitionThread::~AcquisitionThread() {
  thread_.request_stop();
  thread_.join();
}

std::size_t AcquisitionThread::drain(std::span<drivers::Sample> out) {
  return ring_.pop(out.data(), out.size());
}

std::size_t AcquisitionThread::drain_view(std::span<drivers::Sample> out) {
  return view_ring_.pop(out.data(), out.size());
}

AcquisitionThread::Report AcquisitionThread::report() {
  Report report;
  {
    const std::lock_guard lock(mutex_);
    report = std::exchange(report_, {});
  }
  if (threw_.exchange(false)) {
    report.errors.push_back(
        {ErrorKind::exhausted,
         "The acquisition was interrupted by an error of this program or by want "
         "of memory; it connects again."});
  }
  return report;
}

void AcquisitionThread::work(const std::stop_token& stop) {
  name_this_thread("acquisition");
  bool connected = false;
  while (!stop.stop_requested()) {
    // No exception may leave a thread, for example for lack of memory.
    try {
      if (finished_) {
        advance();
        pause(stop, 100ms);
      } else if (!connected) {
        connected = connect(stop);
      } else {
        connected = read_once();
      }
    } catch (const std::exception&) {
      connected = false;
      threw_ = true;
      waker_.wake();
      pause(stop, options_.first_pause);
    }
  }
}

bool AcquisitionThread::connect(const std::stop_token& stop) {
  Nanoseconds wait = options_.first_pause;
  while (!stop.stop_requested()) {
    advance();
    auto outcome = sensor_->connect();
    stamps_ = sensor_->stamp_source();
    tell_health(true);
    if (outcome) return true;
    {
      const std::lock_guard lock(mutex_);
      if (report_.errors.size() < kMaxErrors) report_.errors.push_back(outcome.error());
    }
    waker_.wake();
    pause(stop, wait);
    wait = std::min(2 * wait, options_.longest_pause);
  }
  return false;
}

// Returns false if the link is lost.
bool AcquisitionThread::read_once() {
  const auto count = sensor_->read(buffer_, options_.read_timeout);
  advance();
  if (!count) {
    {
      const std::lock_guard lock(mutex_);
      if (report_.errors.size() < kMaxErrors) report_.errors.push_back(count.error());
    }
    tell_health(true);
    waker_.wake();
    return false;
  }
  const std::size_t kept = ring_.push(buffer_.data(), *count);
  if (kept < *count) overflows_ += *count - kept;
  if (*count > 0) waker_.wake();
  if (viewed_) view_ring_.push(buffer_.data(), *count);
  if (sensor_->finished()) {
    finished_ = true;
    tell_health(true);
  }
  tell_health(false);
  return true;
}

void AcquisitionThread::tell_health(bool must) {
  const Nanoseconds now = clock_.now();
  if (!must && now < next_health_) return;
  next_health_ = now + options_.health_period;
  auto health = sensor_->health();
  if (must) {
    const std::lock_guard lock(mutex_);
    report_.health = std::move(health);
  } else if (const std::unique_lock lock(mutex_, std::try_to_lock); lock) {
    report_.health = std::move(health);
  }
}

void AcquisitionThread::advance() {
  progress_ = clock_.now().count();
}

// Waits in short steps, so that the pause counts as progress.
void AcquisitionThread::pause(const std::stop_token& stop, Nanoseconds duration) {
  const Nanoseconds end = clock_.now() + duration;
  while (!stop.stop_requested() && clock_.now() < end) {
    clock_.sleep_until(std::min(end, clock_.now() + 50ms));
    advance();
  }
}

}  // namespace shaker::daemon
