// Which combinations of parameters the data determine, and which they do not, as sentences.
//
// A parameter is seldom undetermined by itself: it is a combination that can change without the
// response showing it, as c1 and c2 in the paper's example (6.1), of which only the sum acts, or
// the spring and the damping of figure 13. Told so, an operator knows what to fix or what to run.
#pragma once

#include <string>
#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::estimator {

// A way in which the parameters can move together. `change` has all parameters, as shares of their
// own size (of 1 where a parameter is 0); the largest part is 1 for a lost direction, and one
// standard error of the movement for a weak one.
struct Direction {
  std::vector<double> change;
  bool lost = false;  // the data do not feel it at all
};

// Lost directions of a fit, then those that are known to less than kWeak of the parameters' sizes.
inline constexpr double kWeak = 0.3;
std::vector<Direction> open_directions(const Model& model, const Fit& fit);

// "theta3 by -5.1 % with theta4 by +33 %".
std::string in_words(const Model& model, const std::vector<double>& theta,
                     const Direction& direction);

// A warning for each, with the remedy.
std::vector<std::string> determination_warnings(const Model& model, const Fit& fit);

// What any estimate ends with: unknowns on their bounds, and no observation to spare for the noise.
std::vector<std::string> closing_warnings(const std::vector<std::string>& on_bound,
                                          long observations, std::size_t unknowns);

}  // namespace shaker::estimator
