/// \file
/// Robust losses: M-estimates by iteratively reweighted least squares.
///
/// They minimise sum rho(e / s) with the scale s from the median of the absolute residuals. The
/// tuning loses 5 % of efficiency with normal noise. Huber's loss is convex, so it has one optimum.
/// Cauchy's and Tukey's losses reject large outliers and start from Huber's estimate. The covariance
/// is Huber's sandwich K^2 s^2 (sum(psi^2) / (n - q)) / mean(psi')^2 (J^T J)^-1 with n residuals and
/// q free parameters.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

/// The function of a residual that a fit minimises the sum of.
enum class Loss { squared, huber, cauchy, tukey };

/// \param name "squared", "huber", "cauchy" or "tukey"
/// \return the loss; nothing for another name
std::optional<Loss> loss_from_name(std::string_view name);

/// A sample that the model does not explain.
struct Outlier {
  std::size_t run = 0;     ///< index of its run
  std::size_t sample = 0;  ///< index in that run
  double size = 0.0;       ///< residual divided by the scale
};

/// A fit with a robust loss.
struct RobustFit {
  Fit fit;                        ///< with the sandwich covariance if a robust loss converged
  double scale = 0.0;             ///< of one observation of weight 1
  std::vector<Outlier> outliers;  ///< beyond four scales, largest first
  int rounds = 0;                 ///< of new weights
};

/// Throws std::invalid_argument for runs with Fourier coefficients instead of samples, and as
/// Estimator does.
/// \param model the model
/// \param runs the data, one element for each run
/// \param start all parameters, in the model's order and units
/// \param loss to minimise
/// \param options how each fit steps
/// \return the fit; `Fit::trouble` says why it did not converge
RobustFit fit_robust(const Model& model, std::vector<RunData> runs,
                     const std::vector<double>& start, Loss loss,
                     const EstimationOptions& options = {});

/// The covariance that does not assume equal variances (White 1980):
/// G^-1 (sum w^2 e^2 j j^T) G^-1 n / (n - q), G = J^T W J, with q free parameters. If it differs
/// much from Fit::covariance, the weights are wrong.
/// \param model of the estimator
/// \param estimator has made a fit
/// \return free x free, row by row
std::vector<double> sandwich_covariance(const Model& model, const Estimator& estimator);

}  // namespace shaker::estimator
