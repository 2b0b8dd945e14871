// The scores of candidates by the forces along the measured motions of records.
#pragma once

#include <optional>
#include <vector>

#include "estimator/diagnosis/score/internal/scoring.hpp"

namespace shaker::estimator::diagnosis {

// A base model far above noise has bent to imitate what is missing: its fit may stand where no
// effect gains anything, or where the wrong ones do. Forces along the measured motions are nearly
// linear in the parameters, and each effect adds its own. Empty for a base model near noise, for
// other runs than records, and where forces do not follow from the motion alone.
std::optional<Scoring> scored_by_forces(const HarmonicFit& base, const std::vector<RunDatum>& data,
                                        const std::vector<Candidate>& candidates,
                                        const FitOptions& options);

}  // namespace shaker::estimator::diagnosis
