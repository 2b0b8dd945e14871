// What `shakerctl diagnose` found, as one HTML page that stands alone and prints: the verdict in a
// sentence, the gap before and after, where the missing force lies, the effects named, and what
// they cannot be told from. Pure; any thread.
#pragma once

#include <string>

#include "estimator/discrepancy/diagnosis.hpp"

namespace shaker::report {

std::string diagnosis_page(const estimator::discrepancy::Diagnosis& diagnosis);

// The page's first sentence: "coulomb_friction was missing: with it the gap shrinks from 12.4 to
// 1.02 times the noise floor."
std::string diagnosis_sentence(const estimator::discrepancy::Diagnosis& diagnosis);

}  // namespace shaker::report
