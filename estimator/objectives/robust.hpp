// Robust losses: M-estimates by iteratively reweighted least squares.
//
// They minimise sum rho(e / s) with the scale s from the median of the absolute residuals. The
// tuning loses 5 % of efficiency with normal noise. Huber's loss is convex, so it has one optimum.
// Cauchy's and Tukey's losses reject large outliers and start from Huber's estimate. The covariance
// is Huber's sandwich K^2 s^2 (sum(psi^2) / (n - q)) / mean(psi')^2 (J^T J)^-1 with n residuals and
// q free parameters.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

enum class Loss { squared, huber, cauchy, tukey };

std::optional<Loss> loss_from_name(std::string_view name);

struct Outlier {
  std::size_t run = 0, sample = 0;
  double size = 0.0;  // residual divided by the scale
};

struct RobustFit {
  Fit fit;                        // with the sandwich covariance if a robust loss converged
  double scale = 0.0;             // of one observation of weight 1
  std::vector<Outlier> outliers;  // beyond four scales, largest first
  int rounds = 0;
};

// Fits the model from `start` (all parameters). Throws std::invalid_argument for runs with Fourier
// coefficients instead of samples, and as Estimator does.
RobustFit fit_robust(const Model& model, std::vector<RunData> runs,
                     const std::vector<double>& start, Loss loss,
                     const EstimationOptions& options = {});

// Returns the covariance (free x free) that does not assume equal variances (White 1980):
// G^-1 (sum w^2 e^2 j j^T) G^-1 n / (n - q), G = J^T W J, with q free parameters. If it differs
// much from Fit::covariance, the weights are wrong. `estimator` must have a fit.
std::vector<double> sandwich_covariance(const Model& model, const Estimator& estimator);

}  // namespace shaker::estimator
