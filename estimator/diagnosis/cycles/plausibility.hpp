// Are these records of such a rig at all? A unit or a sign that is wrong makes every model wrong,
// and no effect of the catalogue is the answer.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/diagnosis/cycles/steady_cycles.hpp"

namespace shaker::estimator::diagnosis {

// Compares periodic runs with the model at its start values, which are right to some factor. An
// Error when every run moves a hundred times more, or less, or about the mirrored place; a warning
// when every run merely moves the other way. Runs that the model cannot be solved for tell nothing.
Result<void> plausible(const std::vector<SteadyRun>& runs, const config::ModelSpec& model,
                       std::vector<std::string>& warnings);

}  // namespace shaker::estimator::diagnosis
