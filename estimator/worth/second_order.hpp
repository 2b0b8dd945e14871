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
#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::estimator {

// Beyond this share of a standard error the series that the correction breaks off is not to be
// trusted with its first term: figure 13, where it would be a third, gets worse by it.
inline constexpr double kLargestBias = 0.25;

struct SecondOrder {
  std::vector<double> bias;   // of all parameters; 0 for fixed ones
  std::vector<double> bound;  // standard deviation, of all parameters; at the noise of the fit
  double largest_bias = 0.0;  // in standard errors
};

// At the last fit. Empty when that did not converge, a parameter is undetermined or on a bound, or
// there is no periodic solution a tenth of a standard error away. The fit stays.
std::optional<SecondOrder> second_order(Estimator& estimator, const Model& model);

// The last fit with the bias taken off theta; as it was, and false, when that is empty or more than
// kLargestBias. Covariance and sum of squares stay those of the optimum.
bool take_off_bias(Fit& fit, const std::optional<SecondOrder>& effect);
// The same for the published estimate of that fit, intervals moving along; a warning says where the
// bias had to stay in.
void take_off_bias(Estimate& estimate, const std::optional<SecondOrder>& effect);

}  // namespace shaker::estimator
