#include "estimator/diagnosis/noise/internal/excitation_noise.hpp"

#include <algorithm>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTrifle = 0.01;                // of a cosine's variance: not worth a covariance
constexpr Index kNarrowestExcitationBand = 24;  // cosines of a band of the excitation
constexpr int kMaxSpectrumRounds = 25;          // towards its most probable spectrum

// What lies above the band that is compared moves nothing in it.
Index moving(const SampledRun& run, const RunDatum& datum) {
  return std::min(run.excitation_noise.size(), 5 * datum.response.size() / 4);
}

// Of the response over the excitation's cosines; no columns where it does not follow them.
MatrixXd slope_over(const Prediction& prediction, const std::vector<double>& theta, Index count) {
  MatrixXd slope = prediction.over_record(theta, count);
  if (!slope.allFinite()) return {};
  return slope;
}

}  // namespace

bool count_excitation_noise(TransientRuns& runs, const std::vector<RunDatum>& own,
                            const HarmonicFit& fit) {
  bool any = false;
  for (std::size_t r = 0; r < own.size(); ++r) {
    runs.data[r] = own[r];
    const SampledRun& run = *own[r].sampled;
    if (own[r].by_force || run.excitation_noise.size() == 0 || runs.repeated.contains(r)) continue;
    const Index count = moving(run, own[r]);
    const MatrixXd slope = slope_over(fit.predictions[r], fit.theta, count);
    if (slope.cols() == 0) continue;
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

MatrixXd excitation_covariance(const Prediction& prediction, const std::vector<double>& theta,
                               const RunDatum& datum, const VectorXd& left) {
  const SampledRun& run = *datum.sampled;
  if (datum.by_force || run.excitation_noise.size() == 0) return {};
  const MatrixXd slope = slope_over(prediction, theta, moving(run, datum));
  if (slope.cols() == 0) return {};
  const MatrixXd moves = whitened(datum, slope);
  const VectorXd white = whitened(datum, left);
  const Index n = white.size();
  struct Band {
    Index from, count;
    MatrixXd share;  // of the whitened covariance, for a power of 1
    double power;
  };
  std::vector<Band> bands;
  const double size = white.squaredNorm() / static_cast<double>(n);
  for (Index from = 0; from < slope.cols();) {
    Index to = std::min(slope.cols(), from + std::max(kNarrowestExcitationBand, from / 4));
    if (slope.cols() - to < kNarrowestExcitationBand) to = slope.cols();
    const auto of = moves.middleCols(from, to - from);
    bands.push_back({from, to - from, of * of.transpose(),
                     size * run.excitation_noise.segment(from, to - from).mean()});
    from = to;
  }
  for (int round = 0; round < kMaxSpectrumRounds; ++round) {
    MatrixXd whole = MatrixXd::Identity(n, n);
    for (const Band& band : bands)
      whole += band.power * band.share;
    const Cholesky factors(whole);
    if (!factors.positive()) return {};
    const MatrixXd inverse = factors.solve(MatrixXd(MatrixXd::Identity(n, n)));
    const VectorXd weighed = inverse * white;
    for (Band& band : bands) {
      const double more =
          weighed.dot(band.share * weighed) - inverse.cwiseProduct(band.share).sum();
      band.power =
          std::max(0.0, band.power * (1.0 + band.power * more / static_cast<double>(band.count)));
    }
  }
  MatrixXd covariance = MatrixXd::Zero(n, n);
  for (const Band& band : bands) {
    const auto of = slope.middleCols(band.from, band.count);
    covariance.noalias() += band.power * of * of.transpose();
  }
  return covariance;
}

}  // namespace shaker::estimator::diagnosis
