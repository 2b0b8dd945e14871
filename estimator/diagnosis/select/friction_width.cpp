#include "estimator/diagnosis/select/internal/friction_width.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/score/internal/scoring.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Relative to the width of the catalogue: the first width above zero, and the ends of the range.
constexpr double kFirst = 0.2, kNarrowest = 0.02, kWidest = 50.0;
constexpr double kWide[] = {5.0, 15.0};      // that are tried where neither end leads to it
constexpr double kWider = 0.1;               // of a width: for the slope over it
constexpr double kStride = 3.0;              // times as wide, or as narrow, in one step at most
constexpr double kPromised = 0.25;           // of chi-squared, left at most
constexpr double kSettled = 0.1;             // of chi-squared: what another step would gain
constexpr double kMinChiSquaredGain = 10.0;  // of chi-squared
constexpr int kMostSteps = 6, kMostHalves = 2, kMostOfFit = 25;

// A step of the width, with the parameters following it.
struct WidthStep {
  double by = 0.0, gain = 0.0;  // in chi-squared
  double standard_error = 0.0;  // of the width
  VectorXd bends;               // the free parameters, per unit of width
};

// `slope`: derivative of the whitened predictions with respect to the width.
WidthStep step_of(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                  const VectorXd& slope) {
  const MatrixXd j = stacked_jacobian(fit, data, fit.free);
  const VectorXd bends = -(fit.covariance * (j.transpose() * slope));
  const VectorXd own = slope + j * bends;  // what no parameter imitates
  const double along = own.dot(stacked_residual(fit, data)), square = own.squaredNorm();
  return {along / square, along * along / square, 1.0 / std::sqrt(square), bends};
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

// Fits with different widths of one friction, in all its lines.
class Widths {
 public:
  Widths(const HarmonicFit& near, const std::vector<Turning>& turnings,
         const std::vector<RunDatum>& data, const FitOptions& options)
      : spec_(near.spec), turnings_(turnings), data_(data), options_(options) {}

  // Empty if the other width has no solution.
  std::optional<WidthStep> step_from(const HarmonicFit& fit, double width) const {
    const double to = width > 0.0 ? (1.0 + kWider) * width : kFirst * usual();
    const auto wider = predicted(at(to), fit);
    if (!wider) return std::nullopt;
    const VectorXd apart = stacked_residual(fit, data_) - stacked_residual(*wider, data_);
    return step_of(fit, data_, apart / (to - width));
  }

  // The better fit at two wide widths; null if it does not leave far less. A coarse grid follows them.
  std::shared_ptr<HarmonicFit> wide(const HarmonicFit& near, double most, double& width) const {
    std::shared_ptr<HarmonicFit> best;
    double least = std::max(most, kPromised * near.chi_squared);
    for (const double times : kWide) {
      auto next = fitted(at(times * usual()), best ? *best : near, near.theta);
      if (!next->converged || !(next->chi_squared < least)) continue;
      least = next->chi_squared;
      best = std::move(next);
      width = times * usual();
    }
    return best;
  }

  // The fit at the width of a step, or halfway there; null if neither is better.
  std::shared_ptr<HarmonicFit> stepped(const HarmonicFit& fit, const WidthStep& step,
                                       double& width) const {
    double to = std::clamp(width + step.by, kNarrowest * usual(), kWidest * usual());
    if (width > 0.0) to = std::clamp(to, width / kStride, width * kStride);
    for (int half = 0; half <= kMostHalves; ++half, to = 0.5 * (width + to)) {
      auto next = fitted(at(to), fit, moved(fit, step.bends * (to - width)));
      if (!next->converged || !(next->chi_squared < fit.chi_squared)) continue;
      width = to;
      return next;
    }
    return nullptr;
  }

 private:
  double usual() const { return turnings_.front().usual; }

  config::ModelSpec at(double width) const {
    config::ModelSpec spec = spec_;
    for (const Turning& turning : turnings_)
      spec.effects[turning.line].constants[turning.symbol] = width;
    return spec;
  }

  // Other corners get the narrowest width of the grid.
  std::shared_ptr<HarmonicFit> fitted(const config::ModelSpec& spec, const HarmonicFit& near,
                                      const std::vector<double>& theta) const {
    FitOptions fine = options_;
    fine.points = points_for(spec, data_, options_.points);
    fine.sharp = true;
    fine.from_near = true;
    fine.max_iterations = kMostOfFit;
    return std::make_shared<HarmonicFit>(fit_harmonics(spec, data_, theta, &near, fine));
  }

  // The predictions at the parameters of `fit`.
  std::optional<HarmonicFit> predicted(const config::ModelSpec& spec,
                                       const HarmonicFit& fit) const {
    const int points =
        std::max(fit.predictions.front().points(), points_for(spec, data_, options_.points));
    HarmonicFit other;
    other.predictions.reserve(data_.size());
    for (std::size_t r = 0; r < data_.size(); ++r) {
      if (const std::size_t first = first_of_response(data_, r); first < r) {
        other.run_models.push_back(other.run_models[first]);
        other.predictions.emplace_back(other.predictions[first], data_[r]);
      } else {
        other.run_models.push_back(rounded_model(spec, data_[r], points));
        other.predictions.emplace_back(*other.run_models[r], data_[r], points);
        other.predictions[r].start_from(fit.predictions[r]);
      }
    }
    for (std::size_t r = 0; r < data_.size(); ++r) {
      if (data_[r].role == Role::fit && !other.predictions[r].at(fit.theta, HowFar::patient))
        return std::nullopt;
    }
    return other;
  }

  const config::ModelSpec& spec_;
  const std::vector<Turning>& turnings_;
  const std::vector<RunDatum>& data_;
  const FitOptions& options_;
};

// True if the derivative shows that the width may explain the residual.
bool promising(const WidthStep& step, const HarmonicFit& fit, double most) {
  const double left = fit.chi_squared - step.gain;
  return step.gain > kMinChiSquaredGain && left < std::max(most, kPromised * fit.chi_squared);
}

// The lines of the model's friction without memory, if there is one only. What a further input
// drives of it is the same friction, if it has the same width.
std::vector<Turning> only_friction(const HarmonicFit& fit) {
  if (fit.model->coordinates() != fit.model->mechanical()) return {};
  std::vector<Turning> all = turnings_of(fit.spec);
  const auto name = [&](const Turning& turning) {
    return config::driven(fit.spec.effects[turning.line].effect).effect;
  };
  const auto same = [&](const Turning& turning) {
    return name(turning) == name(all.front()) && turning.width == all.front().width;
  };
  if (!std::all_of(all.begin(), all.end(), same)) all.clear();
  return all;
}

}  // namespace

std::shared_ptr<const HarmonicFit> with_fitted_width(const HarmonicFit& near, bool sharp,
                                                     const std::vector<RunDatum>& data,
                                                     const FitOptions& options, double most) {
  const std::vector<Turning> turnings = only_friction(near);
  if (turnings.empty() || !near.covariance.allFinite()) return nullptr;
  const Widths widths(near, turnings, data, options);
  const Turning& turning = turnings.front();
  double width = sharp ? 0.0 : turning.width;
  auto step = widths.step_from(near, width);
  const bool leads = step && promising(*step, near, most);
  std::shared_ptr<HarmonicFit> best =
      leads ? widths.stepped(near, *step, width) : widths.wide(near, most, width);
  for (int tries = 1; best; ++tries) {
    step = widths.step_from(*best, width);
    if (!step) return nullptr;
    const bool more = step->gain > kSettled && tries < kMostSteps;
    auto better = more ? widths.stepped(*best, *step, width) : nullptr;
    if (!better) break;
    best = std::move(better);
  }
  // What reverses over more than the widest is no dry friction.
  if (!best || best->chi_squared > most || width >= kWidest * turning.usual) return nullptr;
  best->constant = {turning.line, turning.symbol,       turning.unit,
                    width,        step->standard_error, step->bends};
  return best;
}

}  // namespace shaker::estimator::diagnosis
