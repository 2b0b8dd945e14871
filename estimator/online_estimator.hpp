// The estimate after every cycle: warm-started, all runs of the campaign counting jointly.
//
// Maximum likelihood with unknown noise variance. Cycles of one run are averaged point by point
// (the sufficient statistic for white noise), the scatter about that mean gives the cycle-to-cycle
// noise. With forgetting < 1 a cycle counts less for every cycle that came after it; with a rate of
// false alarms, a test (online/change_detector.hpp) watches for parameters that change during a
// run.
#pragma once

#include <memory>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/estimate.hpp"
#include "estimator/measured_cycle.hpp"

namespace shaker::estimator {

struct OnlineOptions {
  int grid_points = 128;  // of the periodic solution; the data's n need not divide it
  int max_iterations = 50;
  double forgetting = 1.0;  // weight of a cycle for each cycle of its age, in (0, 1]
  // Rate at which the test for changes may raise false alarms; 0: no test.
  double false_alarms_per_cycle = 0.0;
};

// One thread at a time. The fit in `add` allocates only when a new run begins. Values are without
// the bias of second order where that matters (online/bias_watch.hpp), as in a batch.
class OnlineEstimator {
 public:
  // Throws std::invalid_argument when the model names an unknown effect or parameter, with the
  // place.
  explicit OnlineEstimator(const config::ModelSpec& model, OnlineOptions options = {});
  ~OnlineEstimator();
  OnlineEstimator(OnlineEstimator&&) noexcept;
  OnlineEstimator& operator=(OnlineEstimator&&) noexcept;

  // Exactly one estimate per accepted cycle. An Error (not_converged, invalid) keeps the state of
  // before the cycle's fit but keeps the cycle.
  Result<Estimate> add(const MeasuredCycle& cycle);
  void reset();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace shaker::estimator
