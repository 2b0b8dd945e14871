// What came out, beside what the model file states.
#pragma once

#include "config/model.hpp"
#include "estimator/diagnosis/diagnosis.hpp"

namespace shaker::estimator::diagnosis {

// Constants that the file states and the data did not change stand in the improved model again;
// what they did change, and a unit that the catalogue does not count in, are warned of.
void hold_against_file(const config::ModelSpec& model, Diagnosis& said);

}  // namespace shaker::estimator::diagnosis
