#include "estimator/inference/internal/posterior_excitation.hpp"

#include <cmath>
#include <random>

#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostTries = 100;

// R with R R^T = covariance, which may be singular. Uses the correlations, because the parameters'
// units differ in magnitude.
MatrixXd root_of(const MatrixXd& covariance) {
  const VectorXd size = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const VectorXd scale = (size.array() > 0.0).select(size, 1.0);
  const MatrixXd unit =
      scale.cwiseInverse().asDiagonal() * covariance * scale.cwiseInverse().asDiagonal();
  const Spectrum eigen = spectrum_of(unit);
  const VectorXd stretch = eigen.values.cwiseMax(0.0).cwiseSqrt();
  return scale.asDiagonal() * eigen.vectors * stretch.asDiagonal();
}

bool inside(const VectorXd& theta, const Box& box) {
  for (Index k = 0; k < theta.size(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    if (!(theta[k] >= box.lower[at] && theta[k] <= box.upper[at])) return false;
  }
  return true;
}

}  // namespace

MatrixXd covariance_of_excitation(const Model& model, const Estimator& estimator,
                                  std::vector<RunData> runs, const EstimationOptions& how) {
  bool none = true;
  for (RunData& run : runs) {
    none = none && !(run.excitation_error > 0.0);
    run.excitation_error = 0.0;
  }
  if (none) return {};
  const Fit& with = estimator.last();
  Estimator exact(model, std::move(runs), how);
  exact.start_from(estimator);
  const Fit& without = exact.fit(with.theta, true);
  const auto q = static_cast<Index>(std::lround(std::sqrt(with.covariance.size())));
  return Eigen::Map<const MatrixXd>(with.covariance.data(), q, q) -
         Eigen::Map<const MatrixXd>(without.covariance.data(), q, q);
}

void move_by_excitation(Draws& draws, const MatrixXd& covariance, const Box& box,
                        std::uint64_t seed) {
  const Index d = draws.theta.front().size();
  const MatrixXd root = root_of(covariance);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  VectorXd z(d);
  for (VectorXd& theta : draws.theta) {
    for (int attempt = 0; attempt < kMostTries; ++attempt) {
      for (double& value : z)
        value = normal(random);
      const VectorXd moved = theta + root * z;
      if (!inside(moved, box)) continue;
      theta = moved;
      break;
    }
  }
  weigh(draws);
}

}  // namespace shaker::estimator
