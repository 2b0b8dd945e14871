// The result of `shakerctl diagnose` as one self-contained HTML page that can be printed: the
// verdict in a sentence, the gap before and after, the location of the missing force, the
// selected effects, and their indistinguishable sets. Pure; any thread.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "estimator/discrepancy/diagnosis.hpp"

namespace shaker::report {

// The rows of the title block, a label and a text each. A row without a text is left out.
using TitleBlock = std::vector<std::pair<std::string, std::string>>;

std::string diagnosis_page(const estimator::discrepancy::Diagnosis& diagnosis,
                           const TitleBlock& title = {});

// The page's first sentence: "coulomb_friction was missing: with it the gap shrinks from 12.4 to
// 1.02 times the noise floor."
std::string diagnosis_sentence(const estimator::discrepancy::Diagnosis& diagnosis);

}  // namespace shaker::report
