// The noise of a record's measured excitation. It drives the model and not the damper. The residual
// therefore contains the model's response to it, which correlates many cosines.
#pragma once

#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/noise/internal/transient.hpp"

namespace shaker::estimator::diagnosis {

// Adds the covariance of that noise to the errors of `runs`, through the linearised response of
// `fit`. `own`: the data with the noise of their response alone. Runs with a repetition keep their
// errors. Returns false if no run has such noise.
bool count_excitation_noise(TransientRuns& runs, const std::vector<RunDatum>& own,
                            const HarmonicFit& fit);

// Covariance of the residual `left` of a run, in addition to the datum's own, under the assumption
// that all of it comes from noise of the measured excitation. The spectrum of that noise, in bands,
// is the most probable one (restricted maximum likelihood, by expectation-maximisation). 0 x 0 if
// the excitation was not measured.
Eigen::MatrixXd excitation_covariance(const Prediction& prediction,
                                      const std::vector<double>& theta, const RunDatum& datum,
                                      const Eigen::VectorXd& left);

}  // namespace shaker::estimator::diagnosis
