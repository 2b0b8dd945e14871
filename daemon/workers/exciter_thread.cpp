#include "daemon/workers/exciter_thread.hpp"

#include <algorithm>
#include <exception>

#include <fmt/format.h>

#include "daemon/workers/thread_name.hpp"

namespace shaker::daemon {
namespace {

using namespace std::chrono_literals;

constexpr auto kTurn = 10ms;          // longest wait for orders
constexpr auto kTurnLate = 5ms;       // tolerated delay of the end of a wait
constexpr std::size_t kMaxNews = 64;  // kept while the engine is busy; the oldest are dropped

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
  if (!wanted) barred_ = false;
  keep_alive_ = wanted && !barred_;
}

void ExciterThread::emergency_stop() {
  barred_ = true;
  keep_alive_ = false;
  stop();
}

void ExciterThread::watch(std::vector<Watched> watched) {
  const std::lock_guard lock(watch_mutex_);
  watched_ = std::move(watched);
  seen_.assign(watched_.size(), {});
}

std::vector<ExciterThread::News> ExciterThread::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, {});
}

void ExciterThread::work(const std::stop_token& token) {
  name_this_thread("exciter");
  while (!token.stop_requested()) {
    wait_for_orders(token);
    // No exception may leave a thread, for example for lack of memory.
    try {
      turn();
    } catch (const std::exception&) {
      stop_by_itself();
      threw_ = true;
    }
    progress_ = clock_.now().count();
  }
  // The process ends, so the motion must end, whatever was ordered.
  if (!good(exciter_->stop())) good(exciter_->stop());
}

void ExciterThread::turn() {
  if (threw_) {
    tell(Withheld{
        "the thread that speaks to the exciter was interrupted by an error of this program or by "
        "want of memory; the exciter was stopped at once"});
    threw_ = false;
  }
  watch_over();
  obey();
}

void ExciterThread::stop_by_itself() {
  barred_ = true;
  keep_alive_ = false;
  pending_ = {std::nullopt, true, false};
}

void ExciterThread::wait_for_orders(const std::stop_token& token) {
  const Nanoseconds before = clock_.now();
  std::unique_lock lock(mutex_);
  ordered_.wait_for(lock, token, kTurn,
                    [this] { return mailbox_.stop || mailbox_.setpoint || mailbox_.clear_fault; });
  const Nanoseconds waited = clock_.now() - before;
  if (waited > kTurn + kTurnLate) starved_ += waited - kTurn;
  if (mailbox_.stop) pending_ = {std::nullopt, true, false};
  if (mailbox_.clear_fault) pending_.clear_fault = true;
  if (mailbox_.setpoint) pending_.setpoint = mailbox_.setpoint;
  mailbox_ = {};
}

void ExciterThread::watch_over() {
  if (!keep_alive_) return;
  const Nanoseconds now = clock_.now();
  const std::lock_guard lock(watch_mutex_);
  for (std::size_t i = 0; i < watched_.size(); ++i) {
    const Nanoseconds progress = watched_[i].last_progress();
    if (progress != seen_[i].progress) seen_[i] = {progress, starved_};
    const Nanoseconds still = now - progress - (starved_ - seen_[i].starved);
    if (still <= watched_[i].bound) continue;
    stop_by_itself();
    tell(
        Withheld{fmt::format("{} has not advanced for {:.2f} s, more than {:g} s; the exciter was "
                             "stopped at once",
                             watched_[i].name, seconds(still), seconds(watched_[i].bound))});
    return;
  }
}

void ExciterThread::obey() {
  // Repeats the stop in every turn until the device has taken it; the status is still read.
  if (pending_.stop) pending_.stop = !good(exciter_->stop());
  connect_when_due();
  if (!connected_) return;
  if (pending_.stop) return poll_when_due();
  if (barred_) pending_.setpoint.reset();
  if (std::exchange(pending_.clear_fault, false)) {
    if (!good(exciter_->clear_fault())) return;
    next_poll_ = clock_.now();
  }
  if (const auto setpoint = std::exchange(pending_.setpoint, std::nullopt)) {
    const auto written = exciter_->write(*setpoint);
    if (!written && written.error().kind == ErrorKind::timeout) pending_.setpoint = setpoint;
    if (!good(written)) return;
  }
  keep_alive_when_due();
  poll_when_due();
}

void ExciterThread::connect_when_due() {
  if (connected_ || clock_.now() < next_connect_) return;
  const auto outcome = exciter_->connect();
  if (outcome) {
    // An earlier process (for example a daemon that was killed) may have left the exciter in
    // any state. Start at rest and disabled; this also clears a dead-man that has tripped.
    if (!made_safe_) {
      const auto stopped = exciter_->stop();
      made_safe_ = stopped.ok();
      pending_.stop = !made_safe_;
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
  if (!keep_alive_) return last_heartbeat_.reset();
  if (now < next_heartbeat_) return;
  next_heartbeat_ = now + options_.heartbeat_period;
  if (last_heartbeat_ && now - *last_heartbeat_ >= 3 * options_.heartbeat_period)
    tell(Late{now - *last_heartbeat_});
  last_heartbeat_ = now;
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

// Reports an Error. After the loss of the link it is connected again, after a pause.
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
