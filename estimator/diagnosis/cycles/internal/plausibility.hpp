// Checks units and signs of the records. A wrong unit or sign makes every model wrong, and no
// effect of the catalogue corrects it.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/diagnosis/cycles/steady_cycles.hpp"

namespace shaker::estimator::diagnosis {

// Compares periodic runs with the model at its start values, which are right to some factor.
// Returns an Error if every run moves a hundred times more or less than the model, or about the
// mirrored position. Warns if every run only moves in the opposite direction. Ignores runs for
// which the model has no solution.
Result<void> plausible(const std::vector<SteadyRun>& runs, const config::ModelSpec& model,
                       std::vector<std::string>& warnings);

}  // namespace shaker::estimator::diagnosis
