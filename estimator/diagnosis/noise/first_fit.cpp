#include "estimator/diagnosis/noise/internal/first_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/internal/motion_integrator.hpp"
#include "estimator/diagnosis/fit/internal/predicted_runs.hpp"
#include "estimator/diagnosis/noise/internal/transient.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kFarAboveNoise = 4.0;  // chi-squared a datum
constexpr double kOtherValley = 0.95;   // of chi-squared: closer is the same end, not as exact
constexpr double kForceFloor = 1e-3;    // of the force: what the excitation is known to

VectorXd of_size(const VectorXd& harmonics, Index size) {
  VectorXd same = VectorXd::Zero(size);
  const Index shared = std::min(size, harmonics.size());
  same.head(shared) = harmonics.head(shared);
  return same;
}

// Its forces follow from the motion alone, and no part of it wants the excitation's course.
bool shown_by_motion(const Model& model) {
  return can_be_carried(model) && !model.needs_carrier();
}

}  // namespace

bool is_far_above_noise(const HarmonicFit& fit) {
  return !(fit.chi_squared < kFarAboveNoise * fit.observations);
}

bool serves(const HarmonicFit& fit) {
  if (!std::isfinite(fit.chi_squared) || fit.stopped || !fit.predicts_all) return false;
  return fit.trouble.empty() || is_far_above_noise(fit);
}

void warn_if_unsettled(const HarmonicFit& base, std::vector<std::string>& warnings) {
  if (!base.trouble.empty())
    warnings.push_back(base.trouble + ": it is far from the data without what is missing");
}

bool is_near_noise(const HarmonicFit& fit) {
  return fit.trouble.empty() && !is_far_above_noise(fit);
}

bool is_better(const HarmonicFit& other, const HarmonicFit& fit) {
  if (!other.trouble.empty() || !std::isfinite(other.chi_squared)) return false;
  return !fit.trouble.empty() || other.chi_squared < kOtherValley * fit.chi_squared;
}

RunDatum forces_along_motion(const RunDatum& response, const Model& model) {
  const double f = response.frequency_hz;
  RunDatum datum;
  datum.name = response.name;
  datum.kind = Kind::imposed_motion;
  datum.role = response.role;
  datum.condition = response.condition;
  datum.frequency_hz = f;
  datum.driver = response.response;
  VectorXd excitation = of_size(response.driver, response.response.size());
  excitation[0] = 0.0;  // an accelerometer's offset
  const VectorXd acceleration = derivative(derivative(response.response, f), f);
  datum.response = model.excitation(0) * excitation - model.mass(0, 0) * acceleration;
  const double floor = kForceFloor * root_mean_square(datum.response);
  datum.error.resize(datum.response.size());
  for (Index k = 0; k < datum.error.size(); ++k) {
    const double omega = 2.0 * std::numbers::pi * harmonic_order(k) * f;
    datum.error[k] = std::hypot(model.mass(0, 0) * omega * omega * response.error[k], floor);
  }
  datum.freedom = response.freedom;
  return datum;
}

std::vector<double> fitted_to_forces(const config::ModelSpec& spec,
                                     const std::vector<RunDatum>& data,
                                     const std::vector<double>& start, const FitOptions& options) {
  const Model model(spec);
  if (along_motion(data) || !shown_by_motion(model)) return {};
  std::vector<RunDatum> forces;
  if (on_samples(data)) forces = forces_of_records(data, model);
  for (const RunDatum& datum : data) {
    if (!datum.sampled && datum.quantity == Quantity::displacement)
      forces.push_back(forces_along_motion(datum, model));
  }
  const HarmonicFit along = fit_harmonics(spec, forces, start, nullptr, options);
  return std::isfinite(along.chi_squared) ? along.theta : std::vector<double>{};
}

HarmonicFit first_fit(const config::ModelSpec& spec, const std::vector<RunDatum>& data,
                      const FitOptions& options) {
  HarmonicFit fit = fit_harmonics(spec, data, {}, nullptr, options);
  if (is_near_noise(fit)) return fit;
  const std::vector<double> start = fitted_to_forces(spec, data, {}, options);
  if (start.empty()) return fit;
  HarmonicFit other = fit_harmonics(spec, data, start, nullptr, options);
  return is_better(other, fit) ? std::move(other) : std::move(fit);
}

}  // namespace shaker::estimator::diagnosis
