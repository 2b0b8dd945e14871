// Covariance and undetermined parameters from the singular values of the Jacobian, for problems
// whose Gram matrix is too badly conditioned.
#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "estimator/fit/internal/fit_inference.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/numbers.hpp"

namespace shaker::estimator {
namespace {

// A direction whose singular value is below this share of the largest one (of the scaled Jacobian)
// is lost in the rounding of a periodic solution (1e-11 of the stroke) and of its sensitivities.
constexpr double kSmallestSingular = 1e-8;
// A parameter takes part in a lost direction of unit length if its component exceeds this limit. It
// is above the components that rounding and the weakest determined direction cause.
constexpr double kInvolved = 1e-3;

}  // namespace

// Finds rank, lost directions and covariance from the singular values of the scaled Jacobian.
void FitInference::finish_by_svd() {
  const std::size_t q = data_.free.size();
  const auto columns = static_cast<Eigen::Index>(q);
  Eigen::Index count = 0;
  for (const RunState& run : data_.runs)
    count += static_cast<Eigen::Index>(run.count());
  const Eigen::Index rows = count + (data_.priors ? columns : 0);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(rows, columns);
  Eigen::Index at = 0;
  for (std::size_t r = 0; r < data_.runs.size(); ++r) {
    data_.for_each_datum(
        r, solutions_.systems[r], false, [&](const double* row, double, double weight) {
          for (std::size_t k = 0; k < q; ++k)
            jacobian(at, static_cast<Eigen::Index>(k)) =
                scale_[k] > 0.0 ? std::sqrt(weight) * row[1 + data_.free[k]] / scale_[k] : 0.0;
          ++at;
        });
  }
  for (Eigen::Index k = 0; data_.priors && k < columns; ++k) {
    const auto at_k = static_cast<std::size_t>(k);
    const ModelParameter& p = data_.model.parameters()[static_cast<std::size_t>(data_.free[at_k])];
    if (p.prior_mean && scale_[at_k] > 0.0)
      jacobian(count + k, k) = std::sqrt(data_.noise_variance(equations_.sum_of_squares)) /
                               (*p.prior_standard_deviation * scale_[at_k]);
  }
  const SingularValues svd = singular_values_of(jacobian);
  const Eigen::VectorXd& sigma = svd.values;
  const auto rank = std::min<Eigen::Index>(sigma.size(), columns);
  fit_.condition = sigma[0] / sigma[rank - 1];
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(columns, columns);
  for (Eigen::Index i = 0; i < rank; ++i) {
    const Eigen::VectorXd direction = svd.v.col(i);
    if (sigma[i] > kSmallestSingular * sigma[0]) {
      inverse += direction * direction.transpose() / (sigma[i] * sigma[i]);
      continue;
    }
    std::vector<double> lost(fit_.theta.size(), 0.0);
    for (std::size_t k = 0; k < q; ++k) {
      const double part = direction[static_cast<Eigen::Index>(k)];
      if (std::fabs(part) <= kInvolved) continue;
      fit_.determined[data_.free[k]] = 0;
      lost[data_.free[k]] = scale_[k] > 0.0 ? part / scale_[k] : part;
    }
    fit_.lost.push_back(std::move(lost));
  }
  // A lost direction uses up no degree of freedom.
  fit_.degrees_of_freedom += static_cast<long>(fit_.lost.size());
  finish_noise();
  // The pseudo-inverse: variances of determined parameters do not depend on the lost directions.
  for (std::size_t k = 0; k < q; ++k) {
    for (std::size_t l = 0; l < q; ++l) {
      const double unit = inverse(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l));
      const bool felt = scale_[k] > 0.0 && scale_[l] > 0.0;
      fit_.covariance[k * q + l] = felt ? unit / (scale_[k] * scale_[l]) : 0.0;
    }
    if (!(scale_[k] > 0.0)) fit_.determined[data_.free[k]] = 0;
  }
  if (std::find(fit_.determined.begin(), fit_.determined.end(), 0) != fit_.determined.end())
    fit_.status = FitStatus::undetermined;
}

}  // namespace shaker::estimator
