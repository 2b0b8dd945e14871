#include "estimator/diagnosis/force/internal/inverse_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/internal/motion_integrator.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr int kBins = 24;
constexpr double kEndOfStroke = 0.15;  // of the range that was measured
constexpr double kReversal = 0.15;     // of the largest speed

struct Region {
  std::string words;
  std::function<bool(double stroke, double speed, std::size_t run)> holds;
};

struct Extent {
  double low = 1e300, high = -1e300, speed = 0.0;
};

Extent extent_of(const std::vector<MissingForce>& all) {
  Extent e;
  for (const MissingForce& one : all) {
    if (!one.ok) continue;
    e.low = std::min(e.low, one.stroke.minCoeff());
    e.high = std::max(e.high, one.stroke.maxCoeff());
    e.speed = std::max(e.speed, one.velocity.cwiseAbs().maxCoeff());
  }
  return e;
}

std::vector<Region> regions(const Extent& e, const std::vector<RunDatum>& data,
                            const std::vector<MissingForce>& all) {
  const double reach = kEndOfStroke * (e.high - e.low);
  std::vector<double> fastest;
  for (const MissingForce& one : all)
    fastest.push_back(one.ok ? one.velocity.cwiseAbs().maxCoeff() : 0.0);
  std::vector<Region> list = {
      {"at velocity reversal",
       [fastest](double, double v, std::size_t r) {
         return std::fabs(v) < kReversal * fastest[r];
       }},
      {"on extension only", [](double, double v, std::size_t) { return v < 0.0; }},
      {"on compression only", [](double, double v, std::size_t) { return v > 0.0; }},
      {fmt::format("in the last {:.0f} % of the stroke", 100.0 * kEndOfStroke),
       [=](double u, double, std::size_t) { return u > e.high - reach; }},
      {fmt::format("in the first {:.0f} % of the stroke", 100.0 * kEndOfStroke),
       [=](double u, double, std::size_t) { return u < e.low + reach; }},
      {"at high speed",
       [=](double, double v, std::size_t) { return std::fabs(v) > 0.6 * e.speed; }},
  };
  std::map<long, double> frequencies;
  for (const RunDatum& datum : data)
    frequencies[std::lround(1e3 * datum.frequency_hz)] = datum.frequency_hz;
  if (frequencies.size() > 1) {
    for (const auto& entry : frequencies) {
      const double f = entry.second;
      list.push_back(
          {fmt::format("only at {:.3g} Hz", f), [&data, f](double, double, std::size_t r) {
             return std::fabs(data[r].frequency_hz - f) < 1e-3;
           }});
    }
  }
  return list;
}

std::vector<ForceBin> binned(const std::vector<MissingForce>& before,
                             const std::vector<MissingForce>& after, double low, double high,
                             const std::function<double(const MissingForce&, Index)>& at) {
  std::vector<ForceBin> bins(kBins);
  std::vector<double> count(kBins, 0.0);
  for (std::size_t r = 0; r < before.size(); ++r) {
    if (!before[r].ok) continue;
    for (Index i = 0; i < before[r].force.size(); ++i) {
      const double share = (at(before[r], i) - low) / (high - low);
      const auto bin = static_cast<std::size_t>(std::clamp(share * kBins, 0.0, kBins - 1.0));
      count[bin] += 1.0;
      bins[bin].before += before[r].force[i];
      // The other model's cycle may have another number of points.
      if (after[r].ok)
        bins[bin].after += after[r].force[i * after[r].force.size() / before[r].force.size()];
    }
  }
  std::vector<ForceBin> filled;
  for (std::size_t b = 0; b < bins.size(); ++b) {
    if (count[b] == 0.0) continue;
    filled.push_back({low + (static_cast<double>(b) + 0.5) * (high - low) / kBins,
                      bins[b].before / count[b], bins[b].after / count[b]});
  }
  return filled;
}

}  // namespace

MissingForce missing_force(const Prediction& prediction, const std::vector<double>& theta,
                           const VectorXd& measured) {
  if (const SampledRun* run = prediction.sampled()) {
    // Along the measured motion, whatever was compared.
    const bool imposed = run->kind == Kind::imposed_motion;
    MissingForce missing{run->u, run->v, VectorXd::Zero(run->samples()), false};
    if (!can_be_carried(prediction.model())) return missing;
    MotionIntegrator integrator(prediction.model(),
                                Motion{run->dt, run->u, run->v, run->a, run->excitation}, !imposed);
    missing.ok = integrator.at(theta);
    if (missing.ok) missing.force = -integrator.force();
    if (missing.ok && imposed) missing.force += run->response;
    return missing;
  }
  const VectorXd curve = synthesised(measured, prediction.points());
  if (const ImposedMotion* imposed = prediction.imposed())
    return {imposed->stroke(), imposed->velocity(), curve - imposed->force(), true};
  PeriodicSystem system = prediction.response()->anew();
  const auto state = system.state();
  const int n = system.points();
  const int s = system.model().coordinates();
  const int seen = system.model().observed();
  for (int i = 0; i < n; ++i)
    state[static_cast<std::size_t>(i * s + seen)] = curve[i];
  MissingForce missing{curve, VectorXd::Zero(n), VectorXd::Zero(n), system.linearise(theta)};
  if (!missing.ok) return missing;
  for (int i = 0; i < n; ++i) {
    missing.velocity[i] = system.velocity(i, seen);
    missing.force[i] = -system.g(i, 0);
  }
  return missing;
}

std::string where(const std::vector<MissingForce>& force, const std::vector<RunDatum>& data,
                  double* share) {
  const Extent extent = extent_of(force);
  double total = 0.0, points = 0.0;
  std::vector<double> scale(force.size(), 0.0);
  // Every run counts alike: a force at 1 Hz is no less a force than one at 3 Hz.
  for (std::size_t r = 0; r < force.size(); ++r) {
    if (!force[r].ok) continue;
    total += force[r].force.squaredNorm();
    points += static_cast<double>(force[r].force.size());
  }
  if (!(total > 0.0)) return "nowhere in particular";
  const bool record = on_samples(data);
  std::string best = record ? "everywhere in the record" : "everywhere in the cycle";
  double best_score = 1.35, best_share = 1.0;
  for (const Region& region : regions(extent, data, force)) {
    double power = 0.0, time = 0.0;
    for (std::size_t r = 0; r < force.size(); ++r) {
      if (!force[r].ok) continue;
      for (Index i = 0; i < force[r].force.size(); ++i) {
        if (!region.holds(force[r].stroke[i], force[r].velocity[i], r)) continue;
        power += force[r].force[i] * force[r].force[i] / total;
        time += 1.0 / points;
      }
    }
    // Much of the force in little time.
    const double score = time > 0.0 && power > 0.45 ? power * std::sqrt(power / time) : 0.0;
    if (score > best_score) {
      best_score = score;
      best = region.words;
      best_share = power;
    }
  }
  if (share != nullptr) *share = best_share;
  return best;
}

Location locate(const std::vector<MissingForce>& before, const std::vector<MissingForce>& after,
                const std::vector<RunDatum>& data) {
  Location location;
  const std::string words = where(before, data, &location.share);
  location.words =
      fmt::format("{}: {:.0f} % of the force that is missing", words, 100.0 * location.share);
  const Extent e = extent_of(before);
  location.over_stroke = binned(before, after, e.low, e.high,
                                [](const MissingForce& m, Index i) { return m.stroke[i]; });
  location.over_velocity = binned(before, after, -e.speed, e.speed,
                                  [](const MissingForce& m, Index i) { return m.velocity[i]; });
  location.over_phase = binned(before, after, 0.0, 1.0, [](const MissingForce& m, Index i) {
    return static_cast<double>(i) / static_cast<double>(m.force.size());
  });
  return location;
}

}  // namespace shaker::estimator::diagnosis
