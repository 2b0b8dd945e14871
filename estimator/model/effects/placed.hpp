// A force about a place of rest u0 whose place is a parameter. In the catalogue u0 is a constant; a model
// file that states it among the parameters has it fitted:
//
//   {"effect": "linear_stiffness", "parameters": {"u0": {"start": 0.1, "lower": 0, "upper": 0.2}}}
#pragma once

#include <memory>

#include "estimator/model/effects/effect.hpp"

namespace shaker::estimator {

inline constexpr const char* kPlace = "u0";  // its symbol

// True if the only constant of the effect is its place of rest, on which its force depends as it does on
// the stroke, with the other sign.
bool has_place(const Effect& effect);
// Precondition: has_place. `about` must outlive the result. The place is its last parameter.
std::shared_ptr<const Effect> make_placed(const Effect& about);

}  // namespace shaker::estimator
