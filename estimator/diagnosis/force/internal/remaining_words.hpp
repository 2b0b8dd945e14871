// Describes in words where a force over stroke and velocity acts.
#pragma once

#include <string>

#include "estimator/diagnosis/diagnosis.hpp"

namespace shaker::estimator::diagnosis {

// Names the largest significant maximum, and the largest of the opposite sign if there is one.
std::string in_words(const RemainingForce& force, const std::string& length_unit);

}  // namespace shaker::estimator::diagnosis
