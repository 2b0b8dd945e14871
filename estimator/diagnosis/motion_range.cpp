#include "estimator/diagnosis/internal/motion_range.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::VectorXd;

// Of a run: enough for its cycles, too few to show its noise.
constexpr std::size_t kSpeeds = 10000;
constexpr std::size_t kParts = 16;     // of a run: a decay is swift in one of them
constexpr double kLeastWayBack = 0.1;  // of all the way that a recording goes

double largest(const VectorXd& curve) {
  return curve.size() > 0 ? curve.cwiseAbs().maxCoeff() : 0.0;
}

// Half of what a curve spans: a preload does not count.
double half_span(const VectorXd& curve) {
  return curve.size() > 0 ? 0.5 * (curve.maxCoeff() - curve.minCoeff()) : 0.0;
}

// The largest force per unit mass is that of the load cell along an imposed motion: all of it where
// the motion goes to one side, as friction does. Otherwise the damper balances the excitation and the
// mass' own acceleration.
void widen(MotionRange& range, const SampledRun& run, bool both_ways) {
  range.low = std::min(range.low, run.u.minCoeff());
  range.high = std::max(range.high, run.u.maxCoeff());
  range.speed = std::max(range.speed, largest(run.v));
  // A record's own acceleration is mostly noise: it is estimated by the frequency, v / u.
  const double swing = std::pow(largest(run.v), 2) / half_span(run.u);
  range.force = std::max(range.force, run.kind == Kind::imposed_motion
                                          ? (both_ways ? half_span : largest)(run.response)
                                          : std::max(swing, half_span(run.excitation)));
}

void widen(MotionRange& range, const RunDatum& datum) {
  constexpr int kPoints = 128;
  const auto curve_of = [](const VectorXd& harmonics) -> VectorXd {
    return synthesised(harmonics.head(std::min<Eigen::Index>(harmonics.size(), harmonic_size(6))),
                       kPoints);
  };
  const bool imposed = datum.kind == Kind::imposed_motion;
  const VectorXd curve = curve_of(imposed ? datum.driver : datum.response);
  const VectorXd next = (VectorXd(kPoints) << curve.tail(kPoints - 1), curve[0]).finished();
  const VectorXd last =
      (VectorXd(kPoints) << curve[kPoints - 1], curve.head(kPoints - 1)).finished();
  const double rate = kPoints * datum.frequency_hz;
  range.low = std::min(range.low, curve.minCoeff());
  range.high = std::max(range.high, curve.maxCoeff());
  range.speed = std::max(range.speed, largest(next - curve) * rate);
  range.force =
      std::max(range.force, imposed ? half_span(curve_of(datum.response))
                                    : std::max(largest(next - 2.0 * curve + last) * rate * rate,
                                               half_span(curve_of(datum.driver))));
}

}  // namespace

bool goes_both_ways(const std::vector<RunDatum>& data) {
  std::map<std::string, std::pair<double, double>> ways;  // of a recording: all, and forth
  for (const RunDatum& datum : data) {
    if (!datum.sampled) continue;
    auto& [all, forth] = ways[datum.sampled->record];
    all += datum.sampled->v.cwiseAbs().sum();
    forth += datum.sampled->v.cwiseMax(0.0).sum();
  }
  return std::all_of(ways.begin(), ways.end(), [](const auto& recording) {
    const auto [all, forth] = recording.second;
    return std::min(forth, all - forth) > kLeastWayBack * all;
  });
}

MotionRange range_of(const std::vector<RunDatum>& data) {
  MotionRange range{1e300, -1e300, 0.0, 0.0};
  const bool both_ways = goes_both_ways(data);
  for (const RunDatum& datum : data) {
    if (datum.quantity != Quantity::displacement) continue;
    range.imposed = datum.kind == Kind::imposed_motion;
    if (datum.sampled)
      widen(range, *datum.sampled, both_ways);
    else
      widen(range, datum);
  }
  return range;
}

double swiftest(const Campaign& campaign) {
  double speed = 0.0;
  for (const Recording& run : campaign.runs) {
    const std::size_t n = std::min(run.t.size(), run.displacement.size());
    const std::size_t stride = std::max<std::size_t>(1, n / kSpeeds);
    const std::size_t part = std::max(n / kParts, stride);
    double square = 0.0, count = 0.0;
    for (std::size_t i = stride; i < n; i += stride) {
      const double v =
          (run.displacement[i] - run.displacement[i - stride]) / (run.t[i] - run.t[i - stride]);
      if (std::isfinite(v)) {
        square += v * v;
        ++count;
      }
      if ((i / part == (i + stride) / part && i + stride < n) || count == 0.0) continue;
      speed = std::max(speed, std::sqrt(2.0 * square / count));
      square = count = 0.0;
    }
  }
  return speed;
}

}  // namespace shaker::estimator::diagnosis
