// From what the estimator found to what the stream says.
//
// The daemon and shakerctl publish the same document from the same estimate; neither `protocol` nor
// `estimator` may know the other, so it is done here. Pure; any thread.
#pragma once

#include "estimator/estimate.hpp"
#include "protocol/documents.hpp"

namespace shaker::report {

// Everything an Estimate holds. What only the caller knows (campaign, run, cycle, clock, latency,
// cycles skipped) is left empty for the caller to fill in.
protocol::EstimateDocument to_document(const estimator::Estimate& estimate);

}  // namespace shaker::report
