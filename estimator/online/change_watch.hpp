// Feeds the change detector with measured cycles: prediction and Jacobian at one theta for each
// run, the noise between cycles, and the error of the measured excitation.
//
// Each run is its own reference: it starts anew, at the estimate of that time. A model that
// lacks an effect and has another error at each excitation thus raises no alarm between runs.
// The noise comes from differences of successive cycles, so that neither the misfit nor a
// constant change is in it. One thread at a time may use it; `add` allocates.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "estimator/fit/estimate.hpp"
#include "estimator/online/internal/change_detector.hpp"
#include "estimator/online/internal/cycle_predictor.hpp"

namespace shaker::estimator::online {

class ChangeWatch {
 public:
  // `model` must outlive it.
  ChangeWatch(const Model& model, int grid_points, double false_alarms_per_cycle);

  // Adds a cycle. `theta`: the present estimate, all parameters. Returns the changes detected
  // at this cycle, usually none. If one dwell cannot tell which parameter changed, there are
  // several entries, each with its own jump: the likeliest first, then others that explain the
  // data alone, and, if none does, others above the threshold. A cycle without a periodic
  // solution is skipped.
  std::vector<ParameterChange> add(const MeasuredCycle& cycle, const std::vector<double>& theta);
  void reset();

 private:
  ParameterChange described(const Change& change, const MeasuredCycle& cycle) const;
  void begin_run(const MeasuredCycle& cycle, const std::vector<double>& theta);

  const Model* model_;
  CyclePredictor predictor_;
  double threshold_;
  ChangeDetector detector_;
  int run_ = -1;
  std::vector<double> reference_;        // theta at which this run is linearised
  std::vector<double> last_;             // displacement of the previous cycle
  double squares_ = 0.0, points_ = 0.0;  // of differences between successive cycles
  std::deque<long> indices_;             // of the last cycles, newest last
};

// A sentence for the operator: the first change, whether it alone explains the data, what else
// does, and, early in a run, that a slow transient may be the reason.
std::string sentence(const std::vector<ParameterChange>& changes);

}  // namespace shaker::estimator::online
