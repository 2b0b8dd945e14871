// The campaign file of a plan: the best set of runs, ready for `shakerctl run`.
#pragma once

#include <filesystem>

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/design/plan.hpp"

namespace shaker::cli {

// Writes the best set of the largest size that determines all parameters. An Error where there is
// none, where the file exists, where the model's amplitudes have no size in m/s^2, or where the
// file cannot be written.
Result<void> write_planned_campaign(const std::filesystem::path& file,
                                    const config::ModelSpec& model, const estimator::Plan& plan,
                                    const estimator::PlanOptions& options);

}  // namespace shaker::cli
