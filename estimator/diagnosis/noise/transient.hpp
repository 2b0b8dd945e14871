// Runs that are not periodic, from their records to what the workflow fits: a drop, a free decay, a
// random or swept record, an earthquake on a dynamometer.
//
// What is compared is the response, by time integration (transient_response.hpp). Where no force of
// the model depends on the stroke, a simulation drifts away from the truth whatever is missing (a
// mass with friction, a positioning axis); then, and where the motion is imposed, the forces along
// the measured motion are compared (imposed_motion_bdf2.hpp).
#pragma once

#include <set>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/diagnosis/fit/harmonic_fit.hpp"
#include "estimator/diagnosis/records/transient_run.hpp"
#include "estimator/diagnosis/score/candidates.hpp"

namespace shaker::estimator::diagnosis {

struct TransientRuns {
  std::vector<RunDatum> data;
  // Forces along the measured motion, for a start of the estimation; empty when `data` are those.
  std::vector<RunDatum> forces;
  bool by_force = false;
  std::set<std::size_t> repeated;  // runs whose noise is what their repetition does not do
  std::vector<std::string> warnings;
};

// Throws std::invalid_argument for a model file that is wrong.
Result<TransientRuns> transient_runs(const std::vector<Recording>& recordings,
                                     const config::ModelSpec& model);

// The balance of forces along the measured motion in place of the response: its noise is that of
// the excitation and that of the acceleration, which grows with the square of the frequency.
RunDatum balance_of_forces(const RunDatum& response);

// The base model's fit. Its start comes from the forces along the measured motion, which are
// nearly linear in the parameters: a simulation begun elsewhere would be lost in phase.
HarmonicFit fit_transient(const config::ModelSpec& model, const TransientRuns& runs,
                          const FitOptions& options);

// Two runs of one excitation: what one does that the other does not is noise, of every colour.
// Replaces the errors of such runs; an Error when they differ by far more than noise could.
Result<void> use_repetitions(TransientRuns& runs, const HarmonicFit& fit);

// Without those that a run which is not periodic cannot show; they are named in `not_tried`.
Catalogue shown_by_transients(Catalogue all, const config::ModelSpec& model, bool by_force);

}  // namespace shaker::estimator::diagnosis
