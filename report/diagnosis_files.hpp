// A diagnosis on disk: diagnosis.json, the improved model.json and report.html in one folder.
#pragma once

#include <filesystem>

#include "base/result.hpp"
#include "estimator/discrepancy/diagnosis.hpp"

namespace shaker::report {

// Whether it will be possible, before the work: makes the folder and tries. An Error also where the
// answer would replace `model`, the file that is diagnosed.
Result<void> prepare_diagnosis(const std::filesystem::path& folder,
                               const std::filesystem::path& model);

// Makes the folder; replaces what is there, each file at once or not at all. An Error names the
// file and what the system said.
Result<void> write_diagnosis(const std::filesystem::path& folder,
                             const estimator::discrepancy::Diagnosis& diagnosis);

}  // namespace shaker::report
