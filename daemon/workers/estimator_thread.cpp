#include "daemon/workers/estimator_thread.hpp"

#include <exception>

#include <fmt/format.h>

#include "daemon/workers/thread_name.hpp"

namespace shaker::daemon {

EstimatorThread::EstimatorThread(Clock& clock, Waker& waker, WaveBox* waves)
    : clock_(clock),
      waker_(waker),
      waves_(waves),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

EstimatorThread::~EstimatorThread() {
  thread_.request_stop();
  thread_.join();
}

void EstimatorThread::begin(const config::ModelSpec& model,
                            const estimator::OnlineOptions& options) {
  {
    const std::lock_guard lock(mutex_);
    begun_ = Campaign{model, options};
    waiting_.reset();
    outcomes_.clear();
    skipped_ = 0;
    ++campaign_;
  }
  ordered_.notify_one();
}

void EstimatorThread::add(const estimator::MeasuredCycle& cycle, Nanoseconds last_sample) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_) ++skipped_;
    waiting_ = Job{cycle, last_sample};
    if (!busy_since_) busy_since_ = clock_.now();  // also if the thread never takes it
  }
  ordered_.notify_one();
}

std::vector<EstimateOutcome> EstimatorThread::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(outcomes_, {});
}

std::optional<Nanoseconds> EstimatorThread::busy_since() const {
  const std::lock_guard lock(mutex_);
  return busy_since_;
}

void EstimatorThread::work(const std::stop_token& stop) {
  name_this_thread("estimator");
  while (true) {
    std::unique_lock lock(mutex_);
    if (!ordered_.wait(lock, stop, [this] { return begun_ || waiting_; })) return;
    const auto begun = std::exchange(begun_, std::nullopt);
    const auto job = std::exchange(waiting_, std::nullopt);
    const auto campaign = campaign_;
    const long skipped = skipped_;
    busy_since_ = clock_.now();
    lock.unlock();

    if (begun) start(*begun);
    std::optional<EstimateOutcome> outcome;
    if (job) {
      outcome = EstimateOutcome{job->cycle.run, job->cycle.index, job->last_sample, skipped,
                                fit(job->cycle)};
    }

    lock.lock();
    busy_since_ = waiting_ ? std::optional(clock_.now()) : std::nullopt;
    if (!outcome || campaign != campaign_) continue;
    outcomes_.push_back(std::move(*outcome));
    lock.unlock();
    waker_.wake();
    show(job->cycle);
  }
}

void EstimatorThread::start(const Campaign& campaign) {
  estimator_.reset();
  unusable_.reset();
  try {
    estimator_.emplace(campaign.model, campaign.options);
  } catch (const std::exception& trouble) {
    unusable_ = Error{ErrorKind::invalid, trouble.what()};
  }
}

// Comes after the outcome, which is what matters. A picture that fails is left out.
void EstimatorThread::show(const estimator::MeasuredCycle& cycle) {
  if (waves_ == nullptr) return;
  try {
    estimator::CyclePicture picture;
    if (estimator_) picture = estimator_->picture(cycle);
    waves_->put({.run_index = cycle.run,
                 .cycle = cycle.index,
                 .accepted = true,
                 .frequency_hz = cycle.frequency_hz,
                 .stroke_m = cycle.displacement,
                 .excitation_m_s2 = cycle.excitation,
                 .response_m = std::move(picture.response),
                 .missing_force_m_s2 = std::move(picture.missing_force)});
  } catch (const std::exception&) {  // for lack of memory
  }
}

// No exception may leave a thread: what the estimator throws, for example for lack of memory,
// is the outcome of this cycle.
Result<estimator::Estimate> EstimatorThread::fit(const estimator::MeasuredCycle& cycle) {
  if (unusable_) return *unusable_;
  if (!estimator_) return Error{ErrorKind::invalid, "No campaign has begun: there is no model."};
  try {
    return estimator_->add(cycle);
  } catch (const std::exception& trouble) {
    return Error{ErrorKind::not_converged,
                 fmt::format("The estimator failed on cycle {} of run {}: {}.", cycle.index,
                             cycle.run, trouble.what())};
  }
}

}  // namespace shaker::daemon
