// A measured drop beside its prediction (estimator/drop/measured_drop.hpp): its file, and what is said
// of the comparison.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/result.hpp"
#include "estimator/drop/measured_drop.hpp"

namespace shaker::cli {

using estimator::MeasuredComparison;
using estimator::MeasuredDrop;
using estimator::PredictedDrop;

// Reads t and any of stroke, load and acceleration. `mass`: above the damper, kg; 0: not known, and
// a load in N is refused. Samples before touch-down (t < 0) are left out. An Error names file,
// column and remedy.
Result<MeasuredDrop> read_measured_drop(const std::filesystem::path& file,
                                        const std::string& length_unit, double mass);

// `scale`: of each figure, to what is printed. `unit`: likewise.
struct ComparisonWords {
  std::vector<double> scale;
  std::vector<std::string> label, unit;
};
std::vector<std::vector<std::string>> comparison_rows(const MeasuredComparison& comparison,
                                                      const ComparisonWords& words);
std::vector<std::string> band_sentences(const MeasuredComparison& comparison);
nlohmann::ordered_json comparison_json(const MeasuredComparison& comparison,
                                       const ComparisonWords& words);

}  // namespace shaker::cli
