// The smoothing widths of a model's dry frictions.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "config/model.hpp"
#include "estimator/model/effects/effect.hpp"

namespace shaker::estimator {

// The smoothing width `e` of one friction: a velocity that its own line or the catalogue states.
struct Turning {
  std::size_t line;
  std::string symbol, unit;
  double width, usual;  // the line's, and the catalogue's
  bool stated;          // by the line
};
// True if the force of the effect jumps at v = 0 where its width is 0.
bool jumps(const Effect& effect);
// The smoothing widths of all frictions without memory.
std::vector<Turning> turnings_of(const config::ModelSpec& spec);
// True if a line of the model states the width of its friction.
bool states_smoothing_width(const config::ModelSpec& spec);
}  // namespace shaker::estimator
