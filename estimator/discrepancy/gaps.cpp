#include "estimator/discrepancy/gaps.hpp"

#include <cmath>

#include "estimator/discrepancy/naming.hpp"
#include "estimator/discrepancy/selection.hpp"

namespace shaker::estimator::discrepancy {
namespace {

using Eigen::VectorXd;

double mean_square(const std::vector<VectorXd>& curves) {
  double sum = 0.0;
  for (const VectorXd& c : curves) {
    const double rms = root_mean_square(c);
    sum += rms * rms / static_cast<double>(curves.size());
  }
  return std::sqrt(sum);
}

// Residuals of what was not fitted: held-out runs, or else each run from the others.
std::vector<VectorXd> held_out(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  std::vector<VectorXd> residuals;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role == Role::held_out) residuals.push_back(residual_of(fit, data, r));
  }
  if (!residuals.empty()) return residuals;
  std::vector<VectorXd> left_out;
  if (!cross_validate(fit, data, &left_out)) return {};
  for (std::size_t r = 0; r < data.size(); ++r)
    residuals.push_back(coloured(data[r], left_out[r]));
  return residuals;
}

// What a fit leaves, less what the time base and the grid's limit leave open: the noise that one
// expects given the residual.
VectorXd noise_of(const Fitted& fitted, const std::vector<RunDatum>& data, double clock,
                  std::size_t r) {
  VectorXd left = residual_of(fitted.fit, fitted.data, r);
  if (fitted.data[r].clock.size() > 0) left -= clock * fitted.data[r].clock;
  if (&fitted.data == &data) return left;
  return covariance_of(data[r]) *
         (fitted.data[r].whitening.triangularView<Eigen::Lower>().transpose() *
          whitened(fitted.data[r], left));
}

}  // namespace

void tell_gaps(const Fitted& before, const Fitted& after, const std::vector<RunDatum>& data,
               const std::vector<SteadyRun>& runs, Diagnosis& said) {
  const double clock_before = clock_error(before.fit, data);
  const double clock_after = clock_error(after.fit, after.data);
  std::vector<VectorXd> left_before, left_after;
  for (std::size_t r = 0; r < data.size(); ++r) {
    const VectorXd b = noise_of(before, data, clock_before, r);
    const VectorXd a = noise_of(after, data, clock_after, r);
    const RunDatum& datum = data[r];
    RunGap gap;
    gap.name = datum.name;
    gap.role = datum.role;
    gap.frequency_hz = datum.frequency_hz;
    if (datum.driver.size() > 2) gap.amplitude = std::hypot(datum.driver[1], datum.driver[2]);
    gap.cycles = runs[r].cycles();
    gap.before = root_mean_square(b);
    gap.after = root_mean_square(a);
    said.runs.push_back(std::move(gap));
    if (datum.role != Role::fit) continue;
    left_before.push_back(b);
    left_after.push_back(a);
  }
  said.gap.before = mean_square(left_before);
  said.gap.after = mean_square(left_after);
  const auto out_before = held_out(before.fit, data);
  const auto out_after = held_out(after.fit, after.data);
  if (!out_before.empty() && !out_after.empty()) {
    said.gap.held_out_before = mean_square(out_before);
    said.gap.held_out_after = mean_square(out_after);
  }
}

}  // namespace shaker::estimator::discrepancy
