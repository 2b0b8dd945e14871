// A measured drop that joined the estimate: its record, and the prediction before and after, as
// text, for a page and as JSON.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/result.hpp"
#include "cli/commands.hpp"
#include "cli/diagnosed_drop.hpp"
#include "cli/measured_drop.hpp"
#include "estimator/drop/joined_drop.hpp"

namespace shaker::cli {

// The measured stroke as it joins an estimate. `length`: the model's unit. An Error says that there
// is no stroke, or names the option.
Result<estimator::DropRecord> joining_record(const DropOptions& options,
                                             const MeasuredDrop& measured,
                                             const std::string& length);

// The figures before and after, with their 95 % intervals; the first row is the head. For a drop
// that was joined.
std::vector<std::vector<std::string>> joined_rows(const DiagnosedDrop& drop);
// What the measured drop says of each hypothesis, and whether the intervals hold.
std::vector<std::string> joined_sentences(const DiagnosedDrop& drop);

std::string joined_text(const DiagnosedDrop& drop);
nlohmann::ordered_json joined_json(const DiagnosedDrop& drop);

}  // namespace shaker::cli
