#include "estimator/diagnosis/report/internal/curves.hpp"

#include <algorithm>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/records/internal/transient_cosines.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/diagnosis/report/internal/choice.hpp"

namespace shaker::estimator::diagnosis {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr int kCurvePoints = 128;
constexpr Index kStretchPoints = 400;

std::vector<double> list(const VectorXd& v) {
  return {v.data(), v.data() + v.size()};
}

// kCurvePoints of a finer curve.
std::vector<double> thinned(const VectorXd& curve) {
  std::vector<double> some;
  for (Index i = 0; i < kCurvePoints; ++i)
    some.push_back(curve[i * curve.size() / kCurvePoints]);
  return some;
}

// Samples of a record's stretch that is drawn.
std::pair<Index, Index> drawn(const SampledRun& run) {
  const Index count = std::min<Index>(run.samples(), kStretchPoints);
  Index most = 0;
  run.v.cwiseAbs().maxCoeff(&most);
  const Index first = std::clamp<Index>(most - count / 4, 0, run.samples() - count);
  return {first, count};
}

RunCurves stretch_of(const RunDatum& datum, const VectorXd& before, const VectorXd& after,
                     const MissingForce& force_before, const MissingForce& force_after) {
  const SampledRun& run = *datum.sampled;
  const auto [first, count] = drawn(run);
  const CosineTransform transform(run.samples());
  RunCurves curves;
  curves.name = datum.name;
  curves.from = run.start + run.dt * (static_cast<double>(first) + 0.5);
  curves.seconds = run.dt * static_cast<double>(count);
  curves.measured = list(transform.synthesise(datum.response).segment(first, count));
  curves.before = list(transform.synthesise(before).segment(first, count));
  curves.after = list(transform.synthesise(after).segment(first, count));
  curves.stroke = list(run.u.segment(first, count));
  curves.velocity = list(run.v.segment(first, count));
  if (force_before.ok) curves.force_before = list(force_before.force.segment(first, count));
  if (force_after.ok) curves.force_after = list(force_after.force.segment(first, count));
  return curves;
}

}  // namespace

RunCurves curves_of(const RunDatum& datum, const VectorXd& before, const VectorXd& after,
                    const MissingForce& force_before, const MissingForce& force_after) {
  if (datum.sampled) return stretch_of(datum, before, after, force_before, force_after);
  RunCurves curves;
  curves.name = datum.name;
  const auto synthesis = synthesis_matrix(datum.harmonics(), kCurvePoints);
  curves.measured = list(synthesis * datum.response);
  curves.before = list(synthesis * before);
  curves.after = list(synthesis * after);
  curves.stroke = thinned(force_before.stroke);
  curves.velocity = thinned(force_before.velocity);
  curves.force_before = thinned(force_before.force);
  curves.force_after = thinned(force_after.force);
  const bool imposed = datum.kind == Kind::imposed_motion;
  if (imposed || datum.quantity != Quantity::displacement) return curves;
  curves.velocity_before = list(synthesis * derivative(before, datum.frequency_hz));
  curves.velocity_after = list(synthesis * derivative(after, datum.frequency_hz));
  return curves;
}

std::vector<double> share_of_harmonic(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  std::vector<double> shares;
  double total = 0.0;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].sampled) continue;  // has no harmonics
    const VectorXd e = residual_of(fit, data, r);
    for (Index c = 0; c < e.size(); ++c) {
      const auto h = static_cast<std::size_t>(harmonic_order(c));
      if (shares.size() <= h) shares.resize(h + 1, 0.0);
      const double power = (c == 0 ? 1.0 : 0.5) * e[c] * e[c];
      shares[h] += power;
      total += power;
    }
  }
  for (double& share : shares)
    share /= total > 0.0 ? total : 1.0;
  return shares;
}

}  // namespace shaker::estimator::diagnosis
