// Converts the result of the estimator to the document of the stream.
//
// The daemon and shakerctl publish the same document from the same estimate. Neither `protocol`
// nor `estimator` may include the other, so the conversion is here. Pure; any thread.
#pragma once

#include "estimator/fit/estimate.hpp"
#include "protocol/documents.hpp"

namespace shaker::report {

// Copies everything that an Estimate contains. The caller fills in what only it knows
// (campaign, run, cycle, clock, latency, skipped cycles).
protocol::EstimateDocument to_document(const estimator::Estimate& estimate);

}  // namespace shaker::report
