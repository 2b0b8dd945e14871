// The rest position u0 of a force k (u - u0) is a constant of its line without a derivative, so it
// is fitted by differences. With a wrong rest position other effects (a spring, a sensor offset)
// would compensate and be named too.
#include "estimator/diagnosis/select/internal/centring.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/internal/motion_range.hpp"
#include "estimator/diagnosis/score/internal/scoring.hpp"
#include "estimator/diagnosis/select/internal/refits.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTrifle = 0.1;                        // of chi-squared, that a step promises
constexpr double kDifference = 1e-3;                   // of the place
constexpr double kReach = 0.25;                        // of the place, of a first step
constexpr int kCentringRounds = 12, kFollowing = 200;  // steps of the parameters that follow

struct CentringStep {
  double place = 0.0;
  VectorXd theta;               // of the parameters that are free, along with it
  double gain = 0.0;            // of chi-squared, that is promised
  double standard_error = 0.0;  // of the place
};

// A Gauss-Newton step in which the parameters follow. Empty if the data do not show the position.
std::optional<CentringStep> step_of(const HarmonicFit& fit, const HarmonicFit& lower,
                                    const HarmonicFit& upper, double apart,
                                    const std::vector<RunDatum>& data) {
  const VectorXd residual = stacked_residual(fit, data);
  const VectorXd change = (stacked_residual(lower, data) - stacked_residual(upper, data)) / apart;
  const MatrixXd jacobian = stacked_jacobian(fit, data, fit.free);
  const Projector project(jacobian);
  const VectorXd seen = project(change);
  const double visible = seen.squaredNorm();
  if (!std::isfinite(visible) || visible < 1e-12 * change.squaredNorm()) return std::nullopt;
  CentringStep step;
  const double along = seen.dot(residual);
  step.place = along / visible;
  step.gain = along * along / visible;
  step.standard_error = 1.0 / std::sqrt(visible);
  step.theta = shortest_least_squares(jacobian, change);
  return step;
}

// The predictions of the fit with another rest position, at the same parameters.
HarmonicFit moved(const HarmonicFit& fit, std::size_t line, double place,
                  const std::vector<RunDatum>& data) {
  config::ModelSpec spec = fit.spec;
  spec.effects[line].constants["u0"] = place;
  FitOptions options;
  options.max_iterations = 0;
  options.points = fit.predictions.front().points();
  options.sharp = has_smoothing(spec);
  return fit_harmonics(spec, data, fit.theta, &fit, options);
}

}  // namespace

std::vector<std::size_t> fitted_places(const config::ModelSpec& spec, std::size_t first_added) {
  std::vector<std::size_t> lines;
  for (std::size_t line = first_added; line < spec.effects.size(); ++line) {
    if (spec.effects[line].constants.contains("u0")) lines.push_back(line);
  }
  return lines;
}

std::vector<FittedConstant> places_of(const Hypothesis& h, const std::vector<RunDatum>& data,
                                      std::size_t first_added) {
  const HarmonicFit& fit = rounded(h);
  std::vector<FittedConstant> places;
  for (const std::size_t line : fitted_places(fit.spec, first_added)) {
    const double place = fit.spec.effects[line].constants.at("u0");
    const double difference = kDifference * std::fabs(place);
    const HarmonicFit lower = moved(fit, line, place - difference, data);
    const HarmonicFit upper = moved(fit, line, place + difference, data);
    if (!std::isfinite(lower.chi_squared) || !std::isfinite(upper.chi_squared)) continue;
    const auto step = step_of(fit, lower, upper, 2.0 * difference, data);
    if (!step) continue;
    const double told = h.fit->spec.effects[line].constants.at("u0");
    places.push_back({line, "u0", fit.spec.length_unit, told, step->standard_error, -step->theta});
  }
  return places;
}

std::shared_ptr<const HarmonicFit> Refits::about(const HarmonicFit& fit, std::size_t line,
                                                 double place, const std::vector<double>& theta,
                                                 int iterations) const {
  config::ModelSpec spec = fit.spec;
  spec.effects[line].constants["u0"] = place;
  FitOptions options = options_for(spec);
  options.max_iterations = std::min(options.max_iterations, iterations);
  return std::make_shared<const HarmonicFit>(fit_harmonics(spec, data_, theta, &fit, options));
}

void Refits::centre(Hypothesis& h, std::size_t line) const {
  const auto given = h.fit->spec.effects[line].constants.find("u0");
  if (given == h.fit->spec.effects[line].constants.end()) return;
  const double difference = kDifference * std::fabs(given->second);
  double reach = kReach * std::fabs(given->second);
  // Outside of the motion, a force that bends about its place of rest is nearly a constant: a preload, or
  // friction along a motion to one side.
  const MotionRange range = range_of(data_);
  const double low = std::min(range.low, given->second), high = std::max(range.high, given->second);
  for (int round = 0; round < kCentringRounds && std::isfinite(h.fit->chi_squared); ++round) {
    const HarmonicFit& now = *h.fit;
    const double place = now.spec.effects[line].constants.at("u0");
    const auto lower = about(now, line, place - difference, now.theta, 0);
    const auto upper = about(now, line, place + difference, now.theta, 0);
    if (!std::isfinite(lower->chi_squared) || !std::isfinite(upper->chi_squared)) break;
    const auto step = step_of(now, *lower, *upper, 2.0 * difference, data_);
    if (!step || step->gain < kTrifle) break;
    const double moved =
        std::clamp(place + std::clamp(step->place, -reach, reach), low, high) - place;
    std::vector<double> theta = now.theta;
    for (std::size_t k = 0; k < now.free.size(); ++k) {
      const auto parameter = static_cast<std::size_t>(now.free[k]);
      const ModelParameter& p = now.model->parameters()[parameter];
      theta[parameter] = std::clamp(
          theta[parameter] - moved * step->theta[static_cast<Eigen::Index>(k)], p.lower, p.upper);
    }
    const auto next = about(now, line, place + moved, theta, kFollowing);
    const double won = h.fit->chi_squared - next->chi_squared;
    if (won > 0.0) h.fit = next;
    if (!(won > 0.0)) reach = 0.25 * std::fabs(moved);
    if (std::fabs(won) < kTrifle) break;
  }
}

}  // namespace shaker::estimator::diagnosis
