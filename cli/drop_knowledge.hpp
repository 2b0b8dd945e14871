// What is known of the damper that falls, where nobody diagnosed it: a model at the estimates of one
// campaign or of an estimate's document, and the range of its data.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "cli/commands.hpp"
#include "estimator/model/identified_damper.hpp"

namespace shaker::cli {

struct DropKnowledge {
  estimator::DamperHypothesis hypothesis;  // without the shaker's effects; no covariance: no band
  std::optional<double> fastest, deepest;  // largest speed and stroke of the data, if known
  std::vector<std::string> warnings;
};

// An Error names the file and what it lacks. Throws std::invalid_argument for an estimate of another
// model.
Result<DropKnowledge> drop_knowledge(const DropOptions& options);

}  // namespace shaker::cli
