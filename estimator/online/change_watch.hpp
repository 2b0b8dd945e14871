// Feeds the change detector from measured cycles: prediction and Jacobian at one theta for each
// run, the noise from cycle to cycle, the error of the measured excitation.
//
// A run is its own reference: each begins anew, at the estimate that stood then. So a model that
// lacks an effect, and is off by another amount at each excitation, raises no alarm between runs.
// Noise is taken from successive cycles, so that neither the misfit nor the change itself is in it.
// One thread.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "estimator/estimate.hpp"
#include "estimator/online/change_detector.hpp"
#include "estimator/online/cycle_predictor.hpp"

namespace shaker::estimator::online {

class ChangeWatch {
 public:
  // `model` must outlive it.
  ChangeWatch(const Model& model, int grid_points, double false_alarms_per_cycle);

  // `theta`: the present estimate, all parameters. What changed as of this cycle; usually nothing.
  // One change gives several entries where one dwell cannot tell whose it was: the likeliest first,
  // then the others whose change would look alike, each with its own jump; and where no parameter
  // alone explains it, the others that an alarm could have named. A cycle without a periodic
  // solution is passed over.
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
  std::vector<double> last_;             // displacement of the cycle before
  double squares_ = 0.0, points_ = 0.0;  // of differences between successive cycles
  std::deque<long> indices_;             // of the last cycles, newest last
};

// For the operator: the first of them, whether it alone explains what was seen, what else would,
// and, early in a run, that a slow transient would too.
std::string sentence(const std::vector<ParameterChange>& changes);

}  // namespace shaker::estimator::online
