// The result of `shakerctl diagnose` as one self-contained HTML page that can be printed: the
// verdict in a sentence, the gap before and after, the location of the missing force, the
// selected effects, and their indistinguishable sets. Pure; any thread.
#pragma once

#include <string>

#include "estimator/diagnosis/diagnosis.hpp"
#include "report/page/page.hpp"

namespace shaker::report {

std::string diagnosis_page(const estimator::diagnosis::Diagnosis& diagnosis,
                           const TitleBlock& title = {});

// What the template `diagnosis` shows, for a page that has more than that.
PageValues diagnosis_values(const estimator::diagnosis::Diagnosis& diagnosis);

// The page's first sentence: "coulomb_friction was missing: with it the gap shrinks from 12.4 to
// 1.02 times the noise floor."
std::string diagnosis_sentence(const estimator::diagnosis::Diagnosis& diagnosis);

}  // namespace shaker::report
