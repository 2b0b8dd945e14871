// The catalogue's starts, bounds and widths for motion of another size or in another unit.
#pragma once

#include "config/model.hpp"
#include "estimator/model/effects/effect.hpp"

namespace shaker::estimator {

// A coefficient of a force (a parameter with an `absent` value) follows the force and what it is
// multiplied by: 1/m of a drag is force over speed squared, 1/m of a shape is one over a length.
ParameterInfo scaled(const Effect& effect, const ParameterInfo& info,
                     const config::MotionScale& scale);
// Widths only: another constant is a property, not a range.
ConstantInfo scaled(const ConstantInfo& info, const config::MotionScale& scale);

// The catalogue's bounds are those of a landing gear's damper per unit mass. Where the file states a start
// beyond one of them and does not state that bound, the bound moves beyond the start by a factor of ten. The
// bounds of a sign and of a number without a unit are physics: they stay.
ParameterInfo with_start_inside(const ParameterInfo& info, const config::ParameterSpec& stated);

// Widens the ranges that the model's file does not state to what motion of this scale may need: 0.1 m are no
// range for the zero of a sensor in millivolts. No range gets narrower.
config::ModelSpec with_room(config::ModelSpec model, const config::MotionScale& scale);

// Writes what the scale of each effect stands for into the model, for a reader of its file.
void state_scaled(config::ModelSpec& model);

}  // namespace shaker::estimator
