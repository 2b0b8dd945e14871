#include "estimator/diagnosis/fit/internal/predicted_runs.hpp"

#include <algorithm>

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kFirstStride = 0.25, kLeastStride = 1.0 / 64;

// Along the straight way between two sets of parameters, from the solution at the first of them.
bool walk(Prediction& prediction, const std::vector<double>& from, const std::vector<double>& to) {
  if (!prediction.at(from, HowFar::patient)) return false;
  std::vector<double> theta = from;
  double done = 0.0;
  for (double stride = kFirstStride; done < 1.0 && stride >= kLeastStride;) {
    const double next = std::min(1.0, done + stride);
    for (std::size_t k = 0; k < theta.size(); ++k)
      theta[k] = next < 1.0 ? from[k] + next * (to[k] - from[k]) : to[k];
    const bool there = prediction.at(theta, HowFar::near);
    if (there) done = next;
    stride *= there ? 2.0 : 0.5;
  }
  return done >= 1.0;
}

}  // namespace

bool is_fitted(const RunDatum& datum) {
  return datum.role == Role::fit;
}

bool along_motion(const std::vector<RunDatum>& data) {
  return std::all_of(data.begin(), data.end(), [](const RunDatum& datum) {
    return datum.by_force || datum.kind == Kind::imposed_motion;
  });
}

bool predict_all(HarmonicFit& fit, const std::vector<RunDatum>& data,
                 const std::vector<double>& theta, HowFar search) {
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (!is_fitted(data[r])) continue;
    if (!fit.predictions[r].at(theta, search)) return false;
  }
  return true;
}

bool admit(HarmonicFit& fit, const std::vector<RunDatum>& data, HowFar search) {
  const std::vector<double> start = fit.theta;
  for (const double factor : {0.9, 0.8, 0.65, 0.5}) {
    for (const int k : fit.free) {
      const auto parameter = static_cast<std::size_t>(k);
      const ModelParameter& p = fit.model->parameters()[parameter];
      for (const double by : {factor, 1.0 / factor}) {
        fit.theta = start;
        fit.theta[parameter] = std::clamp(by * start[parameter], p.lower, p.upper);
        if (predict_all(fit, data, fit.theta, search)) return true;
      }
    }
  }
  fit.theta = start;
  return false;
}

bool predict_held_out(HarmonicFit& fit, const std::vector<RunDatum>& data,
                      const std::vector<double>& began, HowFar search) {
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (is_fitted(data[r])) continue;
    Prediction& prediction = fit.predictions[r];
    if (prediction.at(fit.theta, HowFar::patient) || walk(prediction, began, fit.theta)) continue;
    if (search != HowFar::from_rest || !prediction.at(fit.theta, search)) return false;
  }
  return true;
}

}  // namespace shaker::estimator::diagnosis
