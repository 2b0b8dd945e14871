#include "estimator/diagnosis/select/internal/scored_forces.hpp"

#include <cmath>

#include "estimator/diagnosis/fit/internal/motion_integrator.hpp"
#include "estimator/diagnosis/fit/internal/predicted_runs.hpp"
#include "estimator/diagnosis/noise/internal/first_fit.hpp"
#include "estimator/diagnosis/noise/internal/transient.hpp"

namespace shaker::estimator::diagnosis {

std::optional<Scoring> scored_by_forces(const HarmonicFit& base, const std::vector<RunDatum>& data,
                                        const std::vector<Candidate>& candidates,
                                        const FitOptions& options) {
  if (!on_samples(data) || along_motion(data) || !is_far_above_noise(base) ||
      !can_be_carried(*base.model) || base.model->needs_carrier())
    return std::nullopt;
  const std::vector<RunDatum> forces = forces_of_records(data, *base.model);
  const HarmonicFit along = fit_harmonics(base.spec, forces, {}, nullptr, options);
  if (!std::isfinite(along.chi_squared)) return std::nullopt;
  std::vector<Candidate> shown;
  std::vector<const Candidate*> known;  // of each of `shown`
  for (const Candidate& candidate : candidates) {
    if (!shown_by_forces(candidate, base.spec)) continue;
    shown.push_back(candidate);
    known.push_back(&candidate);
  }
  Scoring scoring = score(along, forces, shown, options);
  for (Score& s : scoring.scores)
    s.candidate = known[static_cast<std::size_t>(s.candidate - shown.data())];
  for (NotScored& n : scoring.not_scored)
    n.candidate = known[static_cast<std::size_t>(n.candidate - shown.data())];
  scoring.probed.reset();  // its keys are of `shown`
  return scoring;
}

}  // namespace shaker::estimator::diagnosis
