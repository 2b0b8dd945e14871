// What an estimate from several channels is worth: covariance (3.27) with V corrected for the
// parameters, intervals (3.29), the excitation's own error, lost directions. Private to the sources
// of channels.hpp.
#pragma once

#include "estimator/objectives/channel_likelihood.hpp"

namespace shaker::estimator {

// What can be said without a solution.
void finish_without_solution(const ChannelProblem& problem, Fit& fit);

// At the optimum, `look` being there.
void finish(ChannelProblem& problem, const ChannelLikelihood& likelihood, const ChannelLook& look,
            double confidence, ChannelFit& out);

}  // namespace shaker::estimator
