// A diagnosis on disk: diagnosis.json, the improved model.json, hypotheses.json (for predictions)
// and report.html in one folder.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "report/diagnosis_page.hpp"

namespace shaker::report {

// Checks before the diagnosis that its files can be written: creates the folder and tests it.
// Returns an Error also when a result would replace `model`, the file that is diagnosed.
Result<void> prepare_diagnosis(const std::filesystem::path& folder,
                               const std::filesystem::path& model);

// The files of an earlier diagnosis in the folder, which write_diagnosis replaces.
std::vector<std::filesystem::path> earlier_diagnosis(const std::filesystem::path& folder);

// Creates the folder and replaces existing files; each file is replaced completely or not at
// all. An Error names the file and the message of the system.
Result<void> write_diagnosis(const std::filesystem::path& folder,
                             const estimator::diagnosis::Diagnosis& diagnosis,
                             const TitleBlock& title = {});

}  // namespace shaker::report
