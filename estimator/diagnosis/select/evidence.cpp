#include "estimator/diagnosis/select/internal/evidence.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kPredictable = 0.05;

VectorXd less_clock(const HarmonicFit& fit, const std::vector<RunDatum>& data, std::size_t run,
                    double clock) {
  const VectorXd e = whitened_residual(fit, data, run);
  if (data[run].clock.size() == 0) return e;
  return e - clock * whitened(data[run], data[run].clock);
}

}  // namespace

double log_evidence(const HarmonicFit& fit, const std::vector<RunDatum>& data, int added) {
  const double clock = clock_error(fit, data);
  double sum = -0.5 * clock * clock;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    const VectorXd e = less_clock(fit, data, r, clock);
    for (Index i = 0; i < e.size(); ++i) {
      const double nu = data[r].freedom[i];
      sum -= 0.5 * (nu + 1.0) * std::log1p(e[i] * e[i] / nu);
    }
  }
  return sum - 0.5 * added * std::log(static_cast<double>(fit.observations));
}

std::optional<double> cross_validate(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                     std::vector<LeftOutRun>* left_out) {
  const auto fitted = std::count_if(data.begin(), data.end(),
                                    [](const RunDatum& d) { return d.role == Role::fit; });
  if (left_out != nullptr) left_out->assign(data.size(), {});
  if (fitted < 2 || !fit.covariance.allFinite()) return std::nullopt;
  const double clock = clock_error(fit, data);
  double sum = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    const VectorXd e = less_clock(fit, data, r, clock);
    const MatrixXd j = whitened_jacobian(fit, data, r, fit.free);
    // The other runs leave the prediction of this one uncertain. The residual of the run left out
    // is M^-1 e, its covariance M^-1, with M = I - J (sum J'J)^-1 J'. M differs from the identity
    // only along the few columns of J.
    const MatrixXd root = j * Cholesky(fit.covariance).root();
    const SingularValues few = singular_values_of(root);
    const VectorXd values = (1.0 - few.values.array().square()).max(1e-8);
    const VectorXd along = few.u.transpose() * e;
    sum -= 0.5 * (e.squaredNorm() - along.squaredNorm() +
                  along.cwiseAbs2().cwiseQuotient(values).sum() - values.array().log().sum());
    if (left_out != nullptr) {
      // The others cannot predict what only this run determines.
      const VectorXd taken = values.cwiseMax(kPredictable);
      const VectorXd variance = values.cwiseQuotient(taken.cwiseAbs2());
      (*left_out)[r] = {e + few.u * (along.cwiseQuotient(taken) - along),
                        few.u * (variance.array() - 1.0).max(0.0).sqrt().matrix().asDiagonal()};
    }
  }
  return sum;
}

}  // namespace shaker::estimator::diagnosis
