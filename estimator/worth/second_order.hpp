// What the bend of the model does to an estimate: the bias of least squares, and the scatter that
// no unbiased estimator gets below.
//
// Covariance (3.27) and the Cramer-Rao bound know slopes J only. With second derivatives H_i of
// each prediction and V the covariance of theta, to second order in the noise:
//   bias   -1/2 (J^T J)^-1 J^T c,  c_i = tr(H_i V)                            (Box 1971)
//   bound  the upper left block of B^-1, B the covariance of first and second derivatives of
//          the likelihood over the likelihood (Bhattacharyya 1946); for normal noise of unit
//          variance B_i,jk = J_i . H_jk and
//          B_ij,kl = H_ij . H_kl + (J_i . J_k)(J_j . J_l) + (J_i . J_l)(J_j . J_k).
// Taking the bias off costs nothing where it grows with the estimate (it then shrinks what lies too
// far out), and the scatter falls to the bound of second order, which is as much as there is.
//
// Second derivatives are differences of the exact first ones over a tenth of a standard error along
// the axes of V: 2 q solutions of all runs for q parameters.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::estimator {

// Below this share of a standard error a bias is lost in the scatter (it is a quarter of a per
// cent of the mean square error), and the estimate stays the optimum that other programs find.
inline constexpr double kSmallestBias = 0.05;
// Beyond this share the first term of the series is no longer the bias (of figure 13, where it is a
// third, it takes off too much) and the optimum itself is far from where the likelihood is a
// parabola: then it is said instead, and profile intervals are the answer.
inline constexpr double kLargestBias = 0.25;

// What to do about the bias of an estimate that is published; a Fit stays the optimum.
enum class Bias {
  automatic,  // off where it is between the two shares above
  off,        // left in: the plain optimum
  always      // off whatever its size
};
std::optional<Bias> bias_from_name(std::string_view name);  // auto, off, always
std::string_view name(Bias rule);

struct SecondOrder {
  std::vector<double> bias;   // of all parameters; 0 for fixed ones
  std::vector<double> bound;  // standard deviation, of all parameters; at the noise of the fit
  double largest_bias = 0.0;  // in standard errors
  bool inside = true;         // theta without its bias is within the model's bounds
};

// Converged, every parameter determined and none on a bound.
bool has_second_order(const Fit& fit);

// At the last fit. Empty when that has none, or there is no periodic solution of its branch a tenth
// of a standard error away. The fit stays; its periodic solutions do unless that led off their
// branch.
std::optional<SecondOrder> second_order(Estimator& estimator, const Model& model);

enum class Correction {
  none,       // not asked for, too small to matter, or (automatic) not to be told
  taken_off,  // values are without their bias
  left_in     // should be taken off and cannot be
};

// Takes the bias off theta, or leaves all as it was. Covariance and sum of squares stay those of
// the optimum.
Correction take_off_bias(Fit& fit, const std::optional<SecondOrder>& effect, Bias rule);
// The same for the estimate of that fit. Intervals stay where the optimum's are: of the intervals
// that were tried these cover best (docs/estimation.md). A warning says where the bias is left in.
Correction take_off_bias(Estimate& estimate, const std::optional<SecondOrder>& effect, Bias rule);

// The last fit in full as it is published: described, without its bias.
Estimate published(Estimator& estimator, const Model& model, Bias rule = Bias::automatic);

}  // namespace shaker::estimator
