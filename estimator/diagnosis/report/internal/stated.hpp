// Compares the result with what the model file states.
#pragma once

#include "config/model.hpp"
#include "estimator/diagnosis/diagnosis.hpp"

namespace shaker::estimator::diagnosis {

// Restores constants in the improved model that the file states and the data did not change. Warns
// of those that changed.
void hold_against_file(const config::ModelSpec& model, Diagnosis& said);

}  // namespace shaker::estimator::diagnosis
