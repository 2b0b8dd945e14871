// Finds the combinations of parameters that the data do not determine, and describes them in words.
//
// Usually no single parameter is undetermined. A combination can change without an effect on the
// response: c1 and c2 in the paper's example (6.1), of which only the sum acts, or the spring and
// the damping of figure 13. The warnings tell an operator what to fix or which run to add.
#pragma once

#include <string>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

// A direction in which the parameters can change together. `change` has one element for each
// parameter of the model, relative to the parameter's size (absolute where the parameter is 0). For
// a lost direction the largest element is 1; for a weak one the vector is one standard error long.
struct Direction {
  std::vector<double> change;
  bool lost = false;  // the change has no effect on the data
};

// The lost directions of a fit. Without any, the principal axes of the relative covariance whose
// standard deviation is above kWeak, the weakest first.
inline constexpr double kWeak = 0.3;
std::vector<Direction> open_directions(const Model& model, const Fit& fit);

// "theta3 by -5.1 % with theta4 by +33 %".
std::string in_words(const Model& model, const std::vector<double>& theta,
                     const Direction& direction);

// One warning for each open direction, with the remedy.
std::vector<std::string> determination_warnings(const Model& model, const Fit& fit);

// The last warnings of every estimate: unknowns on a bound, and too few observations to estimate
// the noise.
std::vector<std::string> closing_warnings(const std::vector<std::string>& on_bound,
                                          long observations, std::size_t unknowns);

}  // namespace shaker::estimator
