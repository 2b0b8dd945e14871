#include "estimator/diagnosis/noise/internal/noise_colour.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include "estimator/diagnosis/noise/internal/excitation_noise.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/diagnosis/score/internal/scoring.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kNarrowest =
    12;  // cosines of a band; a quarter of its frequency where that is more
constexpr double kRankThreshold = 1e-9;  // of a direction, that is left of it beside the others

constexpr double kMostNoise = 0.1;  // of a response

// Over stroke and velocity within their ranges ({s}, {r}); {w} jumps where the motion turns round.
constexpr const char* kShapes[] = {"1",
                                   "{s}",
                                   "{s}^2",
                                   "{s}^3",
                                   "{s}^4",
                                   "{r}",
                                   "smooth_abs({r}, 0.01) * {r}",
                                   "{r}^2",
                                   "{r}^3",
                                   "{s} * {r}",
                                   "{s}^2 * {r}",
                                   "{s} * smooth_abs({r}, 0.01) * {r}",
                                   "{s} * {r}^2",
                                   "{w}",
                                   "{s} * {w}"};
static_assert(std::size(kShapes) <= static_cast<std::size_t>(kMostParameters));

struct Range {
  double low = 1e300, high = -1e300, speed = 0.0;
};

Range range_of(const std::vector<RunDatum>& data) {
  Range range;
  for (const RunDatum& datum : data) {
    if (datum.role != Role::fit || !datum.sampled) continue;
    range.low = std::min(range.low, datum.sampled->u.minCoeff());
    range.high = std::max(range.high, datum.sampled->u.maxCoeff());
    range.speed = std::max(range.speed, datum.sampled->v.cwiseAbs().maxCoeff());
  }
  return range;
}

// One effect, a coefficient a shape.
Probe smooth_force(const Range& range) {
  Probe probe;
  probe.line.effect = "smooth_force";
  probe.line.constants = {{"middle", 0.5 * (range.low + range.high)},
                          {"half", 0.5 * (range.high - range.low)},
                          {"speed", range.speed}};
  std::string sum;
  for (std::size_t k = 0; k < std::size(kShapes); ++k) {
    const std::string name = fmt::format("k{}", k);
    const std::string shape =
        fmt::format(fmt::runtime(kShapes[k]), fmt::arg("s", "((u - middle) / half)"),
                    fmt::arg("r", "(v / speed)"), fmt::arg("w", "tanh(v / speed / 0.03)"));
    sum += fmt::format("{}{} * {}", k > 0 ? " + " : "", name, shape);
    probe.line.parameters[name].start = 0.0;
    probe.coefficients.push_back(name);
  }
  probe.line.formula = sum;
  return probe;
}

// Mean square in bands, for each cosine, and how many stand behind it.
VectorXd band_powers(const VectorXd& left, VectorXd& count) {
  const Index size = left.size();
  VectorXd power(size);
  count.resize(size);
  for (Index from = 0; from < size;) {
    Index to = std::min(size, from + std::max(kNarrowest, from / 4));
    if (size - to < kNarrowest) to = size;
    power.segment(from, to - from)
        .setConstant(left.segment(from, to - from).squaredNorm() / static_cast<double>(to - from));
    count.segment(from, to - from).setConstant(static_cast<double>(to - from));
    from = to;
  }
  return power;
}

}  // namespace

bool may_be_noise(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    VectorXd left = data[r].response - fit.predictions[r].value();
    VectorXd seen = data[r].response;
    left[0] = seen[0] = 0.0;  // a zero is no course
    if (left.norm() > kMostNoise * seen.norm()) return false;
  }
  return true;
}

std::vector<RunDatum> with_spectrum_left(const HarmonicFit& fit,
                                         const std::vector<RunDatum>& fitted,
                                         const std::vector<RunDatum>& data, ColourOf of) {
  std::vector<RunDatum> out = data;
  for (std::size_t r = 0; r < data.size(); ++r) {
    // An own zero is no course either.
    const VectorXd left =
        without_own_zero(fitted[r], fitted[r].response - fit.predictions[r].value());
    if (left.size() != data[r].response.size()) continue;
    MatrixXd covariance;
    if (of == ColourOf::excitation)
      covariance = excitation_covariance(fit.predictions[r], fit.theta, data[r], left);
    if (covariance.size() == 0 && !data[r].whitening) {
      const VectorXd power = band_powers(left, out[r].freedom);
      out[r].error = data[r].error.cwiseMax(power.cwiseSqrt());
      continue;
    }
    if (covariance.size() == 0) covariance = MatrixXd::Zero(left.size(), left.size());
    covariance += covariance_of(data[r]);
    const VectorXd known = covariance.diagonal();
    covariance.diagonal() += (band_powers(left, out[r].freedom) - known).cwiseMax(0.0);
    set_covariance(out[r], covariance);
  }
  return out;
}

double spectrum_gain(const ResidualOf& one, const ResidualOf& other) {
  double gain = 0.0;
  VectorXd count;
  for (std::size_t r = 0; r < one.data.size(); ++r) {
    if (one.data[r].role != Role::fit) continue;
    const auto powers = [&](const ResidualOf& of) -> VectorXd {
      const VectorXd left =
          without_own_zero(of.data[r], of.data[r].response - of.fit.predictions[r].value());
      return band_powers(left, count).cwiseMax(1e-300);
    };
    gain += (powers(other).array().log() - powers(one).array().log()).sum();
  }
  return gain;
}

std::optional<double> chance_along_motion(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                          const FitOptions& options) {
  const Range range = range_of(data);
  if (!(range.high > range.low) || !(range.speed > 0.0) || fit.model->mechanical() > 1)
    return std::nullopt;
  MatrixXd along;
  try {
    along = signatures_of(fit, data, smooth_force(range), options).columns;
  } catch (const std::invalid_argument&) {
    return std::nullopt;  // a motion cannot be imposed on this model
  }
  if (along.cols() == 0 || !along.allFinite()) return std::nullopt;
  const MatrixXd jacobian = stacked_jacobian(fit, data, fit.free);
  const Projector project(jacobian);
  const VectorXd left = project(stacked_residual(fit, data));
  const VectorXd length = along.colwise().norm();
  along = project(along) * length.cwiseMax(1e-300).cwiseInverse().asDiagonal();
  PivotedQr qr(along);
  qr.set_threshold(kRankThreshold);
  const auto shapes = static_cast<double>(qr.rank());
  const auto others = static_cast<double>(left.size() - jacobian.cols() - qr.rank());
  if (shapes < 1.0 || others < 1.0) return std::nullopt;
  const double gain = qr.rotated(left).head(qr.rank()).squaredNorm();
  const double beside = left.squaredNorm() - gain;
  return fisher_f_above(gain / shapes / (beside / others), shapes, others);
}

}  // namespace shaker::estimator::diagnosis
