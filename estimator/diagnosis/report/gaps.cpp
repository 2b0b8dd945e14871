#include "estimator/diagnosis/report/internal/gaps.hpp"

#include <cmath>

#include "estimator/diagnosis/noise/internal/noise_floor.hpp"
#include "estimator/diagnosis/report/internal/choice.hpp"
#include "estimator/diagnosis/select/internal/evidence.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Standard deviations: of sums of few squares five in a hundred are further above.
constexpr double kBeyondChance = 2.0;

// What was not fitted: held-out runs, or else each run from the others.
class HeldOut {
 public:
  HeldOut(const HarmonicFit& fit, const std::vector<RunDatum>& data) {
    for (std::size_t r = 0; r < data.size(); ++r) {
      if (data[r].role != Role::held_out) continue;
      MatrixXd slopes(data[r].response.size(), static_cast<Index>(fit.free.size()));
      for (std::size_t k = 0; k < fit.free.size(); ++k)
        slopes.col(static_cast<Index>(k)) = fit.predictions[r].jacobian().col(fit.free[k]);
      add(data[r], residual_of(fit, data, r), slopes * Cholesky(fit.covariance).root());
    }
    std::vector<LeftOutRun> left_out;
    if (!residuals_.empty() || !cross_validate(fit, data, &left_out)) return;
    for (std::size_t r = 0; r < data.size(); ++r)
      add(data[r], coloured(data[r], left_out[r].residual),
          coloured(data[r], left_out[r].uncertain));
  }

  bool empty() const { return residuals_.empty(); }
  double gap() const { return mean_square(residuals_); }
  double level() const {
    const auto runs = static_cast<double>(residuals_.size());
    return std::sqrt((expected_ + kBeyondChance * std::sqrt(variance_)) / runs);
  }

 private:
  // Adds mean and variance of the residual's mean square, a quadratic form of normal numbers.
  void add(const RunDatum& datum, const VectorXd& residual, const MatrixXd& uncertain) {
    residuals_.push_back(without_own_zero(datum, residual));
    VectorXd weight = VectorXd::Constant(residual.size(), 0.5);
    weight[0] = datum.own_zero > 0.0 ? 0.0 : 1.0;
    const MatrixXd covariance = covariance_of(datum) + uncertain * uncertain.transpose();
    expected_ += weight.dot(covariance.diagonal());
    variance_ += 2.0 * weight.dot(covariance.cwiseAbs2() * weight);
  }

  std::vector<VectorXd> residuals_;
  double expected_ = 0.0, variance_ = 0.0;
};

}  // namespace

double tell_gaps(const Fitted& before, const Fitted& after, const std::vector<RunDatum>& data,
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
  const HeldOut out_before(before.fit, data), out_after(after.fit, after.data);
  if (out_before.empty() || out_after.empty()) return 0.0;
  said.gap.held_out_before = out_before.gap();
  said.gap.held_out_after = out_after.gap();
  return out_after.level();
}

}  // namespace shaker::estimator::diagnosis
