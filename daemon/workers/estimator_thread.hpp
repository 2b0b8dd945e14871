// Estimates parameters on a thread of its own, so that no other thread waits for a fit.
//
// One cycle may wait while another is fitted. A newer one replaces it, and the next outcome has
// the number of skipped cycles (they are on disk nevertheless). Each fitted cycle gives exactly
// one outcome. A new campaign discards the waiting cycle and all outcomes of the campaign
// before.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "base/clock.hpp"
#include "daemon/engine.hpp"
#include "daemon/workers/waker.hpp"
#include "daemon/workers/wave_box.hpp"
#include "estimator/online/online_estimator.hpp"

namespace shaker::daemon {

class EstimatorThread final : public EstimatorCommands {
 public:
  // Starts at once. `clock`, `waker` and `waves` outlive it. `waves` gets every fitted cycle.
  EstimatorThread(Clock& clock, Waker& waker, WaveBox* waves = nullptr);
  ~EstimatorThread() override;

  // --- orders, from the engine's thread
  void begin(const config::ModelSpec& model, const estimator::OnlineOptions& options) override;
  void add(const estimator::MeasuredCycle& cycle, Nanoseconds last_sample) override;

  // --- the engine's thread
  std::vector<EstimateOutcome> take();
  // Start of the work on the current cycle; empty if there is none.
  std::optional<Nanoseconds> busy_since() const;

 private:
  struct Job {
    estimator::MeasuredCycle cycle;
    Nanoseconds last_sample{};
  };
  void work(const std::stop_token& stop);
  struct Campaign {
    config::ModelSpec model;
    estimator::OnlineOptions options;
  };
  void start(const Campaign& campaign);
  Result<estimator::Estimate> fit(const estimator::MeasuredCycle& cycle);
  void show(const estimator::MeasuredCycle& cycle);

  Clock& clock_;
  Waker& waker_;
  WaveBox* waves_;
  mutable std::mutex mutex_;
  std::condition_variable_any ordered_;
  std::optional<Campaign> begun_;  // a campaign that has just begun
  std::optional<Job> waiting_;
  long skipped_ = 0;
  std::uint64_t campaign_ = 0;
  std::optional<Nanoseconds> busy_since_;
  std::vector<EstimateOutcome> outcomes_;

  // of the thread
  std::optional<estimator::OnlineEstimator> estimator_;
  std::optional<Error> unusable_;  // the model cannot be built
  std::jthread thread_;            // last
};

}  // namespace shaker::daemon
