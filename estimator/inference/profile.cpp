#include "estimator/inference/internal/profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace shaker::estimator {
namespace {

constexpr int kMostPoints = 40;        // for one end
constexpr double kCloseEnough = 1e-3;  // relative tolerance of t
constexpr double kFarthest = 1e3;      // standard errors; an end farther away is open

// Follows the profile outwards from the estimate on one side.
class ProfileWalk {
 public:
  ProfileWalk(Estimator& estimator, const Model& model, int parameter, double side)
      : estimator_(estimator),
        parameter_(static_cast<std::size_t>(parameter)),
        fit_(estimator.last()),
        theta_(fit_.theta),
        change_(theta_.size(), 0.0) {
    std::size_t q = 0, at = 0;
    for (std::size_t k = 0; k < theta_.size(); ++k) {
      if (model.parameters()[k].fixed) continue;
      if (k == parameter_) at = q;
      free_.push_back(k);
      ++q;
    }
    // Derivative of the other parameters with respect to the held one, from the covariance.
    for (std::size_t l = 0; l < q; ++l)
      follow_.push_back(fit_.covariance[l * q + at] / fit_.covariance[at * q + at]);
    const ModelParameter& p = model.parameters()[parameter_];
    bound_ = side > 0 ? p.upper : p.lower;
    for (const std::size_t k : free_) {
      lower_.push_back(model.parameters()[k].lower);
      upper_.push_back(model.parameters()[k].upper);
    }
  }

  double value() const { return theta_[parameter_]; }
  double bound() const { return bound_; }

  // t at `value`, reached in one step from the last point; empty if the fit fails there.
  std::optional<double> t_at(double value) {
    const std::vector<double> before = theta_;
    const double by = value - theta_[parameter_];
    for (std::size_t l = 0; l < free_.size(); ++l) {
      const double target = std::clamp(theta_[free_[l]] + follow_[l] * by, lower_[l], upper_[l]);
      change_[free_[l]] = (free_[l] == parameter_ ? value : target) - theta_[free_[l]];
      theta_[free_[l]] += change_[free_[l]];
    }
    theta_[parameter_] = value;
    estimator_.extrapolate_states(change_);
    const auto excess = estimator_.profile_fit(static_cast<int>(parameter_), theta_);
    if (!excess) {
      theta_ = before;
      estimator_.restore_solutions();
      theta_ = fit_.theta;
      return std::nullopt;
    }
    // The secant of this step predicts the next one.
    if (std::fabs(by) > 0.0) {
      for (std::size_t l = 0; l < free_.size(); ++l)
        follow_[l] = (theta_[free_[l]] - before[free_[l]]) / by;
    }
    return std::sqrt(std::max(*excess, 0.0));
  }

 private:
  Estimator& estimator_;
  std::size_t parameter_;
  const Fit fit_;
  std::vector<double> theta_, change_, follow_, lower_, upper_;
  std::vector<std::size_t> free_;
  double bound_ = 0.0;
};

struct End {
  double value = 0.0;
  bool open = false;
  std::vector<ProfilePoint> points;
};

// Secant method on t, which is nearly linear, within its bracket.
End walk_out(Estimator& estimator, const Model& model, int parameter, double side) {
  const auto at = static_cast<std::size_t>(parameter);
  const double estimate = estimator.last().theta[at];
  const double error = estimator.last().standard_error[at];
  const double wanted = estimator.last().quantile;
  ProfileWalk walk(estimator, model, parameter, side);
  End end;
  double inner = estimate, inner_t = 0.0;
  double outer = std::numeric_limits<double>::quiet_NaN(), outer_t = 0.0;
  double next = estimate + side * wanted * error;
  for (int i = 0; i < kMostPoints; ++i) {
    const bool past = side > 0 ? next >= walk.bound() : next <= walk.bound();
    if (past) next = walk.bound();
    const auto t = walk.t_at(next);
    if (t) end.points.push_back({next, side * *t});
    if (t && std::fabs(*t - wanted) < kCloseEnough * wanted) {
      end.value = next;
      return end;
    }
    if (t && *t < wanted) {
      if (past || std::fabs(next - estimate) > kFarthest * error) {
        end.value = past ? walk.bound() : side * std::numeric_limits<double>::infinity();
        end.open = true;
        return end;
      }
      inner = next;
      inner_t = *t;
    } else {
      outer = next;
      outer_t = t.value_or(std::numeric_limits<double>::quiet_NaN());
    }
    const double width = std::fabs(outer - inner);
    if (std::isnan(outer)) {
      // Extrapolates the slope so far outwards; at most doubles the distance.
      const double slope = inner_t / std::max(std::fabs(inner - estimate), 1e-300);
      const double step = std::min((wanted - inner_t) / std::max(slope, 1e-300),
                                   std::max(std::fabs(inner - estimate), error));
      next = inner + side * 1.05 * std::max(step, 1e-3 * error);
    } else if (std::isnan(outer_t)) {
      if (width < 1e-3 * error) {
        end.value = inner;
        end.open = true;
        return end;
      }
      next = 0.5 * (inner + outer);
    } else {
      const double share = (wanted - inner_t) / (outer_t - inner_t);
      next = inner + std::clamp(share, 0.02, 0.98) * (outer - inner);
      if (width < 1e-12 * std::fabs(estimate)) break;
    }
  }
  end.value = inner;
  end.open = std::isnan(outer_t) || std::isnan(outer);
  return end;
}

}  // namespace

ProfileInterval profile_interval(Estimator& estimator, const Model& model, int parameter) {
  ProfileInterval interval;
  interval.parameter = parameter;
  interval.points.push_back({estimator.last().theta[static_cast<std::size_t>(parameter)], 0.0});
  for (const double side : {-1.0, 1.0}) {
    End end = walk_out(estimator, model, parameter, side);
    estimator.restore_solutions();
    (side < 0 ? interval.lower : interval.upper) = end.value;
    (side < 0 ? interval.lower_open : interval.upper_open) = end.open;
    interval.points.insert(interval.points.end(), end.points.begin(), end.points.end());
  }
  std::sort(interval.points.begin(), interval.points.end(),
            [](const ProfilePoint& a, const ProfilePoint& b) { return a.value < b.value; });
  return interval;
}

std::vector<ProfileInterval> profile_intervals(Estimator& estimator, const Model& model) {
  std::vector<ProfileInterval> all;
  const Fit& fit = estimator.last();
  if (fit.status != FitStatus::converged || !(fit.quantile > 0.0)) return all;
  for (int k = 0; k < model.parameter_count(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    if (model.parameters()[at].fixed || !fit.determined[at] || !(fit.standard_error[at] > 0.0))
      continue;
    all.push_back(profile_interval(estimator, model, k));
  }
  return all;
}

bool profile_contains(Estimator& estimator, const Model& model, int parameter, double value) {
  const auto at = static_cast<std::size_t>(parameter);
  const double wanted = estimator.last().quantile;
  ProfileWalk walk(estimator, model, parameter, value > estimator.last().theta[at] ? 1.0 : -1.0);
  auto t = walk.t_at(value);
  if (!t) {
    // The step is too long for one fit: search for the end instead.
    estimator.restore_solutions();
    const ProfileInterval interval = profile_interval(estimator, model, parameter);
    return value >= interval.lower && value <= interval.upper;
  }
  estimator.restore_solutions();
  return *t <= wanted;
}

}  // namespace shaker::estimator
