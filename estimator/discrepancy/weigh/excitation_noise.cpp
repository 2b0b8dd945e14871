#include "estimator/discrepancy/weigh/excitation_noise.hpp"

#include <algorithm>

namespace shaker::estimator::discrepancy {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTrifle = 0.01;  // of a cosine's variance: not worth a covariance

}  // namespace

bool count_excitation_noise(TransientRuns& runs, const std::vector<RunDatum>& own,
                            const HarmonicFit& fit) {
  bool any = false;
  for (std::size_t r = 0; r < own.size(); ++r) {
    runs.data[r] = own[r];
    const SampledRun& run = *own[r].sampled;
    if (own[r].by_force || run.excitation_noise.size() == 0 || runs.repeated.contains(r)) continue;
    // What lies above the band that is compared moves nothing in it.
    const Index count = std::min(run.excitation_noise.size(), 5 * own[r].response.size() / 4);
    const MatrixXd slope = fit.predictions[r].over_record(fit.theta, count);
    if (slope.cols() == 0 || !slope.allFinite()) continue;
    const MatrixXd spread = slope * run.excitation_noise.head(count).cwiseSqrt().asDiagonal();
    const VectorXd variance = own[r].error.cwiseAbs2();
    if ((spread.rowwise().squaredNorm().array() < kTrifle * variance.array()).all()) continue;
    MatrixXd covariance = variance.asDiagonal();
    covariance.noalias() += spread * spread.transpose();
    set_covariance(runs.data[r], covariance);
    any = true;
  }
  return any;
}

}  // namespace shaker::estimator::discrepancy
