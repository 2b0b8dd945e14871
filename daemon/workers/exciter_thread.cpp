#include "daemon/workers/exciter_thread.hpp"

#include <algorithm>

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;

constexpr auto kTurn = 10ms;          // between two looks at what is due
constexpr std::size_t kMaxNews = 64;  // kept for a main loop that is busy; older ones go first

}  // namespace

ExciterThread::ExciterThread(std::unique_ptr<drivers::Exciter> exciter, Clock& clock, Waker& waker,
                             ExciterOptions options)
    : exciter_(std::move(exciter)),
      clock_(clock),
      waker_(waker),
      options_(options),
      pause_(options.first_pause),
      progress_(clock.now().count()),
      thread_([this](const std::stop_token& token) { work(token); }) {}

ExciterThread::~ExciterThread() {
  thread_.request_stop();
  thread_.join();
}

void ExciterThread::set(const drivers::Setpoint& setpoint) {
  {
    const std::lock_guard lock(mutex_);
    mailbox_.setpoint = setpoint;
  }
  ordered_.notify_one();
}

void ExciterThread::stop() {
  {
    const std::lock_guard lock(mutex_);
    mailbox_ = {std::nullopt, true, false};
  }
  ordered_.notify_one();
}

void ExciterThread::clear_fault() {
  {
    const std::lock_guard lock(mutex_);
    mailbox_.clear_fault = true;
  }
  ordered_.notify_one();
}

void ExciterThread::keep_alive(bool wanted) {
  keep_alive_ = wanted;
}

std::vector<ExciterThread::News> ExciterThread::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, {});
}

void ExciterThread::work(const std::stop_token& token) {
  while (!token.stop_requested()) {
    wait_for_orders(token);
    obey();
    progress_ = clock_.now().count();
  }
  // Whatever was wanted before: the process ends, and nothing may go on shaking.
  if (!good(exciter_->stop())) good(exciter_->stop());
}

void ExciterThread::wait_for_orders(const std::stop_token& token) {
  std::unique_lock lock(mutex_);
  ordered_.wait_for(lock, token, kTurn,
                    [this] { return mailbox_.stop || mailbox_.setpoint || mailbox_.clear_fault; });
  if (mailbox_.stop) pending_ = {std::nullopt, true, false};
  if (mailbox_.clear_fault) pending_.clear_fault = true;
  if (mailbox_.setpoint) pending_.setpoint = mailbox_.setpoint;
  mailbox_ = {};
}

void ExciterThread::obey() {
  if (pending_.stop) {
    if (!good(exciter_->stop())) return;  // again at the next turn, until the device has taken it
    pending_.stop = false;
  }
  connect_when_due();
  if (!connected_) return;
  if (std::exchange(pending_.clear_fault, false)) {
    if (const auto cleared = exciter_->clear_fault(); !cleared && !good(cleared.error())) return;
    next_poll_ = clock_.now();
  }
  if (const auto setpoint = std::exchange(pending_.setpoint, std::nullopt)) {
    if (!good(exciter_->write(*setpoint))) return;
  }
  keep_alive_when_due();
  poll_when_due();
}

void ExciterThread::connect_when_due() {
  if (connected_ || clock_.now() < next_connect_) return;
  const auto outcome = exciter_->connect();
  if (outcome) {
    // Whoever shook the table before (a daemon that was killed) has left it in some state: at rest
    // and disabled is the one to begin with, and clears a dead-man that has tripped.
    if (!made_safe_) {
      const auto stopped = exciter_->stop();
      made_safe_ = stopped.ok();
      if (!stopped) tell(stopped.error());
    }
    connected_ = true;
    pause_ = options_.first_pause;
    return;
  }
  tell(outcome.error());
  next_connect_ = clock_.now() + pause_;
  pause_ = std::min(2 * pause_, options_.longest_pause);
}

void ExciterThread::keep_alive_when_due() {
  const Nanoseconds now = clock_.now();
  if (!keep_alive_ || now < next_heartbeat_) return;
  next_heartbeat_ = now + options_.heartbeat_period;
  good(exciter_->heartbeat());
}

void ExciterThread::poll_when_due() {
  const Nanoseconds now = clock_.now();
  if (!connected_ || now < next_poll_) return;
  next_poll_ = now + options_.poll_period;
  auto status = exciter_->read();
  if (status) {
    tell(*status);
  } else {
    good(status.error());
  }
}

// Tells what went wrong. A link that is gone is connected again, after a pause.
bool ExciterThread::good(const Result<void>& outcome) {
  if (outcome) return true;
  const ErrorKind kind = outcome.error().kind;
  if (connected_ && (kind == ErrorKind::unavailable || kind == ErrorKind::io)) {
    connected_ = false;
    next_connect_ = clock_.now() + options_.first_pause;
  }
  tell(outcome.error());
  return false;
}

void ExciterThread::tell(News news) {
  {
    const std::lock_guard lock(mutex_);
    if (news_.size() >= kMaxNews) news_.erase(news_.begin());
    news_.push_back(std::move(news));
  }
  waker_.wake();
}

}  // namespace shaker::daemon
