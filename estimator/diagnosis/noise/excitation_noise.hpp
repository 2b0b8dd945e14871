// The noise of a record's measured excitation: the model is driven by it and the damper is not, so
// that it stands in the residual as the model responds to it, over many cosines at once.
#pragma once

#include <vector>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"
#include "estimator/diagnosis/noise/transient.hpp"

namespace shaker::estimator::diagnosis {

// Gives the errors of `runs` the covariance of that noise, run through the response of `fit`
// linearised, besides `own`: the data with the noise of their response alone. Runs with a
// repetition keep theirs. False when no run has such noise.
bool count_excitation_noise(TransientRuns& runs, const std::vector<RunDatum>& own,
                            const HarmonicFit& fit);

// Covariance of what `fit` leaves of a run (`left`), besides the datum's own, if all of it came
// from noise of the measured excitation: with the spectrum of that noise, in bands, under which it
// is most probable (restricted maximum likelihood by expectation and maximisation). 0 x 0 where the
// excitation was not measured.
Eigen::MatrixXd excitation_covariance(const Prediction& prediction,
                                      const std::vector<double>& theta, const RunDatum& datum,
                                      const Eigen::VectorXd& left);

}  // namespace shaker::estimator::diagnosis
