// The hypotheses of a diagnosis as "shaker-damper/1": what a prediction goes on from.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.hpp"
#include "estimator/model/identified_damper.hpp"

namespace shaker::report {

// The file in the folder of a diagnosis.
inline constexpr const char* kDamperFile = "hypotheses.json";

// Two-space indented JSON: each hypothesis with its model, its estimate and its covariance.
std::string damper_json(const estimator::IdentifiedDamper& damper);

// Reads what damper_json wrote. `place`: the file, or the folder of a diagnosis. An Error names the
// file, the entry and the remedy.
Result<estimator::IdentifiedDamper> read_damper(const std::filesystem::path& place);

}  // namespace shaker::report
