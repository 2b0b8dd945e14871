// Inference for an estimate from several channels: covariance (3.27) with V corrected for the
// number of parameters, intervals (3.29), the error of the excitation, undetermined directions.
// Private to the sources of channels.hpp.
#pragma once

#include "estimator/fit/objectives/internal/channel_likelihood.hpp"

namespace shaker::estimator {

// Fills the fields of `fit` for a fit without a solution (NaN covariance).
void finish_without_solution(const ChannelProblem& problem, Fit& fit);

// Fills `out` at the optimum, where `look` was computed. `confidence`: of the intervals, 0 to 1.
void finish(ChannelProblem& problem, const ChannelLikelihood& likelihood, const ChannelLook& look,
            double confidence, ChannelFit& out);

}  // namespace shaker::estimator
