#include "estimator/diagnosis/report/gaps.hpp"

#include <cmath>

#include "estimator/diagnosis/noise/noise_floor.hpp"
#include "estimator/diagnosis/report/choice.hpp"
#include "estimator/diagnosis/select/evidence.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::VectorXd;

// Residuals of what was not fitted: held-out runs, or else each run from the others.
std::vector<VectorXd> held_out(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
  std::vector<VectorXd> residuals;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role == Role::held_out)
      residuals.push_back(without_own_zero(data[r], residual_of(fit, data, r)));
  }
  if (!residuals.empty()) return residuals;
  std::vector<VectorXd> left_out;
  if (!cross_validate(fit, data, &left_out)) return {};
  for (std::size_t r = 0; r < data.size(); ++r)
    residuals.push_back(without_own_zero(data[r], coloured(data[r], left_out[r])));
  return residuals;
}

}  // namespace

void tell_gaps(const Fitted& before, const Fitted& after, const std::vector<RunDatum>& data,
               const std::vector<RunDatum>& measured, const std::vector<SteadyRun>& runs,
               Diagnosis& said) {
  const auto all_before = fit_residuals(before, data, data.size());
  const auto all_after = fit_residuals(after, data, data.size());
  const NoiseFloor noise = noise_floor(after.fit, measured, data.size());
  std::vector<VectorXd> left_before, left_after;
  for (std::size_t r = 0; r < data.size(); ++r) {
    const RunDatum& datum = data[r];
    RunGap gap;
    gap.name = datum.name;
    gap.role = datum.role;
    gap.frequency_hz = datum.frequency_hz;
    if (datum.driver.size() > 2) gap.amplitude = std::hypot(datum.driver[1], datum.driver[2]);
    gap.cycles = runs[r].cycles();
    gap.before = root_mean_square(all_before[r]);
    gap.after = root_mean_square(all_after[r]);
    gap.noise = noise.runs[r].expected;
    gap.noise_floor = noise.runs[r].floor;
    said.runs.push_back(std::move(gap));
    if (datum.role != Role::fit) continue;
    left_before.push_back(all_before[r]);
    left_after.push_back(all_after[r]);
  }
  said.gap.noise = noise.whole.expected;
  said.gap.noise_floor = noise.whole.floor;
  said.gap.before = mean_square(left_before);
  said.gap.after = mean_square(left_after);
  const auto out_before = held_out(before.fit, data);
  const auto out_after = held_out(after.fit, after.data);
  if (!out_before.empty() && !out_after.empty()) {
    said.gap.held_out_before = mean_square(out_before);
    said.gap.held_out_after = mean_square(out_after);
  }
}

}  // namespace shaker::estimator::diagnosis
