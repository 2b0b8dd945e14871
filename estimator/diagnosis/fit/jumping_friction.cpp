#include "estimator/diagnosis/fit/internal/jumping_friction.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/turning.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// Of the first fit's friction, by which it may be off: it creeps where the mass sticks. A decay of ten
// swings ends in another valley after 5 %.
constexpr double kOff = 0.2;
constexpr int kStarts = 17, kFitted = 3;  // that are looked at, and from which a fit begins
constexpr double kFits = 2.0;             // of chi-squared a datum: no other valley is looked for

// The lines with friction that jumps.
std::vector<Turning> jumps_of(const config::ModelSpec& spec) {
  std::vector<Turning> all = turnings_of(spec);
  std::erase_if(all, [&](const Turning& turning) {
    const Effect* effect = find_effect(spec.effects[turning.line].effect);
    return turning.stated || effect == nullptr || !jumps(*effect);
  });
  return all;
}

// How the free parameters follow the first friction's size, per unit of it; empty if that is fixed.
VectorXd along_friction(const HarmonicFit& fit) {
  for (const Model::Term& term : fit.model->terms()) {
    if (!jumps(*term.effect)) continue;
    const auto found = std::find(fit.free.begin(), fit.free.end(), term.first_parameter);
    if (found == fit.free.end() || !fit.covariance.allFinite()) continue;
    const auto at = static_cast<Index>(found - fit.free.begin());
    const double size = fit.theta[static_cast<std::size_t>(term.first_parameter)];
    return size / fit.covariance(at, at) * fit.covariance.col(at);
  }
  return {};
}

std::vector<double> moved(const HarmonicFit& fit, const VectorXd& by) {
  std::vector<double> theta = fit.theta;
  for (std::size_t k = 0; k < fit.free.size(); ++k) {
    const auto at = static_cast<std::size_t>(fit.free[k]);
    const ModelParameter& p = fit.model->parameters()[at];
    theta[at] = std::clamp(theta[at] + by[static_cast<Index>(k)], p.lower, p.upper);
  }
  return theta;
}

// The starts, the best first.
std::vector<std::vector<double>> starts_of(const HarmonicFit& first,
                                           const std::vector<RunDatum>& data, int points) {
  const VectorXd along = along_friction(first);
  if (along.size() == 0) return {};
  std::vector<std::shared_ptr<const Model>> models;
  std::vector<std::pair<std::size_t, Prediction>> runs;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    models.push_back(rounded_model(first.spec, data[r], points, true));
    runs.emplace_back(r, Prediction(*models.back(), data[r], points));
    runs.back().second.start_from(first.predictions[r]);
  }
  std::vector<std::pair<double, std::vector<double>>> seen;
  for (int i = 0; i < kStarts; ++i) {
    const double share = kOff * (2.0 * i / (kStarts - 1) - 1.0);
    const std::vector<double> theta = moved(first, share * along);
    double sum = 0.0;
    const bool solved = std::all_of(runs.begin(), runs.end(), [&](auto& run) {
      if (!run.second.at(theta, HowFar::near)) return false;
      const RunDatum& datum = data[run.first];
      sum += whitened(datum, datum.response - run.second.value()).squaredNorm();
      return true;
    });
    if (solved) seen.emplace_back(sum, theta);
  }
  std::sort(seen.begin(), seen.end());
  std::vector<std::vector<double>> starts;
  for (auto& [sum, theta] : seen)
    starts.push_back(std::move(theta));
  return starts;
}

}  // namespace

bool can_jump(const config::ModelSpec& spec, const std::vector<RunDatum>& data) {
  if (jumps_of(spec).empty()) return false;
  const Model model(spec);
  int velocities = 0;
  for (int c = 0; c < model.coordinates(); ++c)
    velocities += model.order(c) > 1 ? 1 : 0;
  return velocities == 1 && std::all_of(data.begin(), data.end(), [](const RunDatum& datum) {
           return datum.sampled && !datum.by_force;
         });
}

std::shared_ptr<HarmonicFit> fit_of_jumps(const HarmonicFit& first,
                                          const std::vector<RunDatum>& data, FitOptions options) {
  options.at_once = true;
  std::shared_ptr<HarmonicFit> best;
  const auto begin = [&](const std::vector<double>& theta) {
    auto fit =
        std::make_shared<HarmonicFit>(fit_harmonics(first.spec, data, theta, &first, options));
    if (fit->converged && fit->predicts_all && (!best || fit->chi_squared < best->chi_squared))
      best = std::move(fit);
    return best && best->chi_squared < kFits * best->observations;
  };
  if (begin(first.theta)) return best;
  const auto starts = starts_of(first, data, options.points);
  for (std::size_t k = 0; k < std::min<std::size_t>(starts.size(), kFitted); ++k) {
    if (begin(starts[k])) break;
  }
  return best;
}

}  // namespace shaker::estimator::diagnosis
