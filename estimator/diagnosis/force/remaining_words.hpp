// Where a force over stroke and velocity lies, in an operator's words.
#pragma once

#include <string>

#include "estimator/diagnosis/diagnosis.hpp"

namespace shaker::estimator::diagnosis {

// The largest significant hill and, where there is one, the largest of the other sign.
std::string in_words(const RemainingForce& force, const std::string& length_unit);

}  // namespace shaker::estimator::diagnosis
