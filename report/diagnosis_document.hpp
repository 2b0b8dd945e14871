// A diagnosis as "shaker-diagnosis/1" (protocol/schema/diagnosis.schema.json) and as a table.
#pragma once

#include <string>

#include "estimator/diagnosis/diagnosis.hpp"

namespace shaker::report {

// Two-space indented JSON. Numbers that are not finite are left out.
std::string diagnosis_json(const estimator::diagnosis::Diagnosis& diagnosis);

// For a terminal: verdict, effects, gap, warnings.
std::string diagnosis_table(const estimator::diagnosis::Diagnosis& diagnosis);

// "dry friction, probability 0.61 (coulomb_friction 0.40, presliding_friction 0.21)".
std::string kind_sentence(const estimator::diagnosis::KindShare& kind);

}  // namespace shaker::report
