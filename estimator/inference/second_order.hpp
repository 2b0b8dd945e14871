/// \file
/// Effects of the model's curvature on an estimate: the bias of least squares, and a lower bound for
/// the scatter of an unbiased estimator.
///
/// The covariance (3.27) and the Cramer-Rao bound use the Jacobian J only. With the second
/// derivatives H_i of each prediction and the covariance V of theta, to second order in the noise:
///   bias   -1/2 (J^T J)^-1 J^T c,  c_i = tr(H_i V)                            (Box 1971)
///   bound  the upper left block of B^-1, B the covariance of first and second derivatives of
///          the likelihood over the likelihood (Bhattacharyya 1946); for normal noise of unit
///          variance B_i,jk = J_i . H_jk and
///          B_ij,kl = H_ij . H_kl + (J_i . J_k)(J_j . J_l) + (J_i . J_l)(J_j . J_k).
/// Where the bias grows with the estimate, its subtraction also reduces the scatter, down to the
/// bound of second order.
///
/// The second derivatives are central differences of the exact first ones over a tenth of a standard
/// error along the columns of V's Cholesky factor: 2 q + 1 solutions of all runs for q parameters.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

/// A bias below this number of standard errors is negligible against the scatter (0.25 % of the mean
/// square error) and is not subtracted: the estimate stays the optimum that other programs find.
inline constexpr double kSmallestBias = 0.05;
/// Above this number of standard errors the first term of the series does not describe the bias (for
/// figure 13, where it is a third, the subtraction is too large), and the likelihood is not a
/// parabola near the optimum. A warning then recommends profile intervals.
inline constexpr double kLargestBias = 0.25;

/// Whether the bias is subtracted from a published estimate. A Fit always stays the optimum.
enum class Bias {
  automatic,  ///< subtract a bias between the two limits above
  off,        ///< do not subtract
  always      ///< subtract a bias of any size
};
/// \param name "auto", "off" or "always"
/// \return the rule; nothing for another name
std::optional<Bias> bias_from_name(std::string_view name);
/// \param rule any
/// \return its name
std::string_view name(Bias rule);

/// Bias and bound of an estimate.
struct SecondOrder {
  std::vector<double> bias;   ///< of all parameters; 0 for fixed ones
  std::vector<double> bound;  ///< standard deviation, of all parameters; at the noise of the fit
  double largest_bias = 0.0;  ///< in standard errors
  bool inside = true;         ///< theta - bias is within the model's bounds
};

/// \param fit any
/// \return true if it has converged, has a covariance, and no parameter is on a bound
bool has_second_order(const Fit& fit);

/// Bias and bound at the last fit. The estimator keeps its fit, and also its periodic solutions
/// unless the search left their branch.
/// \param estimator has made a fit
/// \param model its model
/// \return nothing if has_second_order() is false, or if a periodic solution of the fitted branch is
///   not found a tenth of a standard error away
std::optional<SecondOrder> second_order(Estimator& estimator, const Model& model);

/// What take_off_bias() did.
enum class Correction {
  none,       ///< not requested, negligible, or (automatic) unknown
  taken_off,  ///< the bias has been subtracted
  left_in     ///< the bias should be subtracted but cannot be
};

/// Subtracts the bias from theta, or changes nothing. Covariance and sum of squares stay those
/// of the optimum.
/// \param fit the optimum
/// \param effect its bias, if that is known
/// \param rule when it is subtracted
/// \return what was done
Correction take_off_bias(Fit& fit, const std::optional<SecondOrder>& effect, Bias rule);
/// The same for the estimate of that fit. The intervals stay those of the optimum, which have the
/// best measured coverage (docs/estimation.md). A warning is added where the bias cannot be
/// subtracted.
/// \param estimate of the optimum
/// \param effect its bias, if that is known
/// \param rule when it is subtracted
/// \return what was done
Correction take_off_bias(Estimate& estimate, const std::optional<SecondOrder>& effect, Bias rule);

/// Describes the last fit as it is published.
/// \param estimator has made a fit
/// \param model its model
/// \param rule when the bias is subtracted
/// \return the estimate, with the bias subtracted
Estimate published(Estimator& estimator, const Model& model, Bias rule = Bias::automatic);

}  // namespace shaker::estimator
