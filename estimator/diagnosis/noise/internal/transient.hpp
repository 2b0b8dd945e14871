// Prepares runs that are not periodic for the fit: a drop, a free decay, a random or swept record,
// an earthquake on a dynamometer.
//
// The response is compared, by time integration (transient_response.hpp), with one exception. If no
// force of the model depends on the stroke (a mass with friction, a positioning axis), a simulation
// drifts away from the truth whatever is missing. Then, and if the motion is imposed, the forces
// along the measured motion are compared (motion_integrator.hpp).
#pragma once

#include <set>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/diagnosis/score/internal/candidates.hpp"

namespace shaker::estimator::diagnosis {

struct TransientRuns {
  std::vector<RunDatum> data;
  // Forces along the measured motion, for the start of the fit. Empty if `data` are those forces.
  std::vector<RunDatum> forces;
  bool by_force = false;
  std::set<std::size_t> repeated;  // runs whose noise is what their repetition does not do
  std::vector<std::string> warnings;
};

// Throws std::invalid_argument for a model file that is wrong.
Result<TransientRuns> transient_runs(const std::vector<Recording>& recordings,
                                     const config::ModelSpec& model);

// Turns a response into forces along the measured motion. The noise is that of the excitation and
// that of the acceleration, which grows with the square of the frequency.
RunDatum balance_of_forces(const RunDatum& response);

// The same of all runs, to find where a fit to the responses begins. Their mean is left out where the
// model rests at the zero of the displacement.
std::vector<RunDatum> forces_of_records(const std::vector<RunDatum>& data, const Model& model);

// Fits the base model. The start comes from the forces along the measured motion, which are nearly
// linear in the parameters. A simulation from other start values would soon be out of phase.
HarmonicFit fit_transient(const config::ModelSpec& model, const TransientRuns& runs,
                          const FitOptions& options);

// Uses two runs with the same excitation: the difference of their responses is noise, whatever its
// colour. Replaces the errors of such runs. Returns an Error if they differ by far more than noise
// can.
Result<void> use_repetitions(TransientRuns& runs, const HarmonicFit& fit);

// True if the forces along a measured motion show the effect.
bool shown_by_forces(const Candidate& candidate, const config::ModelSpec& model);
// Removes the effects that a run without a period cannot show, and lists them in `not_tried`.
Catalogue shown_by_transients(Catalogue all, const config::ModelSpec& model,
                              const TransientRuns& runs);

}  // namespace shaker::estimator::diagnosis
