// Curves for the pictures, with a few hundred points each.
#pragma once

#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/force/internal/inverse_dynamics.hpp"

namespace shaker::estimator::diagnosis {

// Returns one cycle of a run, or the liveliest part of a record without a period. `before` and
// `after`: predicted harmonics.
RunCurves curves_of(const RunDatum& datum, const Eigen::VectorXd& before,
                    const Eigen::VectorXd& after, const MissingForce& force_before,
                    const MissingForce& force_after);

// Share of the gap's power in each harmonic, from the mean on; empty for runs without a period.
std::vector<double> share_of_harmonic(const HarmonicFit& fit, const std::vector<RunDatum>& data);

}  // namespace shaker::estimator::diagnosis
