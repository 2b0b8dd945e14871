// The steps of a TransientResponse's integration.
#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/diagnosis/fit/internal/transient_response.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/solve/time/integrators.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMaxStepsPerSample = 8;   // of the integration between two samples
constexpr int kMostWhereItSticks = 16;  // the same, where no implicit steps can be taken
constexpr double kFelt = 0.1;  // of all data's standard errors together: what steps may move
constexpr double kUnstable = 2.6;
constexpr double kStable = 1.2;  // largest eigenvalue of the equations times the step

}  // namespace

// As many as are accurate. Explicit steps must be shorter than the fastest decay or oscillation
// besides: friction on a narrow edge is stiff.
int TransientResponse::steps_between_samples(const std::vector<double>& theta) const {
  constexpr int kPoints = 8;
  const int seen = model_->observed(), speed = equations_.velocity_of(seen);
  StateEquations::Workspace work;
  AlignedVector store(
      static_cast<std::size_t>((2 * m_ + m_ * m_ + 1 + m_ * equations_.parameters()) * kPoints));
  std::vector<double*> s, rate, h_s, h_theta;
  double* next = store.data();
  const auto take = [&](std::vector<double*>& list, int count) {
    for (int k = 0; k < count; ++k, next += kPoints)
      list.push_back(next);
  };
  take(s, m_);
  take(rate, m_);
  take(h_s, m_ * m_);
  take(h_theta, m_ * equations_.parameters());
  double fastest = 0.0;
  MatrixXd slopes(m_, m_);
  for (std::size_t from = 0; from < arcs_.size(); from += kPoints / 2) {
    for (std::size_t i = 0; i < kPoints; ++i) {
      const std::size_t a = std::min(from + i / 2, arcs_.size() - 1);
      for (int j = 0; j < m_; ++j)
        s[static_cast<std::size_t>(j)][i] = arcs_[a].start[static_cast<std::size_t>(j)];
      if (speed < 0) continue;
      double& v = s[static_cast<std::size_t>(speed)][i];
      if (i % 2 == 0) v = 0.0;
      if (std::fabs(v) < still_) v = std::copysign(still_, v);
    }
    if (!equations_.rates(kPoints, s.data(), next, theta.data(), work, rate.data(), h_s.data(),
                          h_theta.data()))
      continue;
    for (int i = 0; i < kPoints; ++i) {
      for (int r = 0; r < m_; ++r) {
        for (int c = 0; c < m_; ++c)
          slopes(r, c) = h_s[static_cast<std::size_t>(r * m_ + c)][i] * scale_[c] / scale_[r];
      }
      // Not the rows' sums: those of a stiff spring grow with the square of its frequency.
      if (slopes.allFinite())
        fastest = std::max(fastest, eigenvalues_of(slopes).cwiseAbs().maxCoeff());
    }
  }
  // Not an int before it is known to fit: a wild trial's slopes know no bounds.
  const double steps = std::max(1.0 * least_steps_, std::ceil(fastest * run_->dt / kStable));
  const int most = still_ > 0.0 ? kMostWhereItSticks : kMaxStepsPerSample;
  if (steps <= most) return static_cast<int>(steps);
  if (still_ > 0.0) return most;
  return fastest * run_->dt / kMaxStepsPerSample < kUnstable ? kMaxStepsPerSample : 0;
}

bool TransientResponse::integrate(const std::vector<double>& theta) {
  const int explicit_steps = steps_between_samples(theta);
  const bool stiff = explicit_steps == 0;
  const int steps = stiff ? least_steps_ : explicit_steps;
  if (!integration_ || stiff != stiff_ || steps > steps_ || 2 * steps < steps_) {
    TimeOptions options;
    options.step = run_->dt / steps;
    options.cut = model_->has_velocity_kink() && model_->coordinates() == 1
                      ? CutAtReversals::automatic
                      : CutAtReversals::never;
    if (datum_.budget)
      options.afford = [budget = datum_.budget](double numbers) {
        return budget->spend_rates(numbers);
      };
    options.still = still_;
    integration_ = still_ > 0.0 ? make_stick_slip(equations_, options, free_)
                   : stiff      ? make_implicit_runge_kutta(equations_, options, free_)
                                : make_runge_kutta(equations_, options, free_);
    steps_ = steps;
    stiff_ = stiff;
  }
  if (!integration_->run(arcs_, theta, true).ok) return false;
  const bool bounded = std::all_of(arcs_.begin(), arcs_.end(), [&](const Arc& arc) {
    return std::all_of(arc.states.begin(), arc.states.end(),
                       [](double x) { return std::isfinite(x) && std::fabs(x) < 1e100; });
  });
  if (bounded && !sized_) size_memories();
  return bounded;
}

// From the data, where steps that serve a motion of the model overshoot into what is inadmissible.
bool TransientResponse::integrate_finer(const std::vector<double>& theta) {
  const int before = least_steps_;
  while (!stiff_ && steps_ < kMaxStepsPerSample) {
    least_steps_ = std::min(2 * steps_, kMaxStepsPerSample);
    if (integrate(theta)) return true;
  }
  least_steps_ = before;
  return false;
}

// Shorter steps until half of one moves the response by less than the data feel: a record long
// after its start adds up the phase that each step loses.
void TransientResponse::settle_steps(const std::vector<double>& theta) {
  steps_settled_ = true;
  while (steps_ < kMaxStepsPerSample) {
    const int coarse = least_steps_;
    const VectorXd value = value_;
    least_steps_ = std::min(2 * steps_, kMaxStepsPerSample);
    const bool closed = close(theta);
    if (closed && whitened(datum_, value_ - value).norm() > kFelt) continue;
    least_steps_ = coarse;
    solved_ = close(theta);
    return;
  }
}

}  // namespace shaker::estimator::diagnosis
