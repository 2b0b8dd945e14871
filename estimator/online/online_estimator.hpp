/// \file
/// Sequential estimation: one estimate after every cycle, from all runs of the campaign together,
/// with a warm start.
///
/// The estimate is the maximum likelihood with unknown noise variance. Cycles of one run are
/// averaged point by point, which is the sufficient statistic for white noise. Their scatter
/// about the mean contains the noise between cycles. With forgetting < 1 a cycle loses weight
/// with every later cycle. With a false-alarm rate, a test (online/internal/change_detector.hpp) detects
/// parameters that change during a run.
#pragma once

#include <memory>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "config/run_condition.hpp"
#include "estimator/fit/estimate.hpp"
#include "estimator/online/cycle_picture.hpp"
#include "estimator/online/measured_cycle.hpp"

namespace shaker::estimator {

/// How an OnlineEstimator fits.
struct OnlineOptions {
  int grid_points = 128;    ///< least number for the periodic solution; raised to fit the data
  int max_iterations = 50;  ///< steps of one fit until it gives up
  double forgetting = 1.0;  ///< factor on a cycle's weight for every later cycle, in (0, 1]
  /// False-alarm rate of the test for changes, per cycle; 0: no test.
  double false_alarms_per_cycle = 0.0;
  /// Name, group and conditions of all runs of the campaign, in their order: parameters that the
  /// model lets differ between runs then do, and an estimate has their values in the run of the
  /// last cycle. Empty: one value for all runs.
  std::vector<config::RunCondition> runs = {};
};

/// One thread at a time may use it. `add` allocates. The estimates are corrected for second-order
/// bias where it matters (online/internal/bias_watch.hpp), as in a batch estimation.
class OnlineEstimator {
 public:
  /// Throws std::invalid_argument for an invalid model, naming the place in its file, or for a
  /// forgetting factor outside (0, 1].
  /// \param model the model file's content
  /// \param options how to fit
  explicit OnlineEstimator(const config::ModelSpec& model, OnlineOptions options = {});
  /// Releases the workspace.
  ~OnlineEstimator();
  /// Takes the workspace over; the other may only be destroyed or assigned to.
  OnlineEstimator(OnlineEstimator&&) noexcept;
  /// Takes the workspace over; the other may only be destroyed or assigned to.
  /// \return this estimator
  OnlineEstimator& operator=(OnlineEstimator&&) noexcept;

  /// Adds a cycle and returns the new estimate. Error `invalid`: the cycle cannot be used; one
  /// with non-finite samples or another number of points is left out. Error `not_converged`: the
  /// cycle counts, but the last good theta stays and the next fit starts from it.
  /// \param cycle one period; all cycles of a run have the same number of points
  /// \return the estimate from all cycles so far
  Result<Estimate> add(const MeasuredCycle& cycle);
  /// What the last good estimate says of `cycle`, the last one that was added. Empty vectors
  /// where `add` gave no estimate.
  /// \param cycle the last cycle that was added
  /// \return the model's response and the force that it lacks
  CyclePicture picture(const MeasuredCycle& cycle) const;
  /// Forgets all cycles and starts again from the model's own parameters.
  void reset();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace shaker::estimator
