#include "estimator/solve/periodic/periodic_lanes.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/solve/periodic/internal/lane_step.hpp"

namespace shaker::estimator {

bool PeriodicLanes::possible(const Model& model, const GridOptions& options) {
  return model.lanes_possible() && options.scheme != Scheme::fourier;
}

PeriodicLanes::PeriodicLanes(const Model& model, const GridOptions& options, bool sensitivities)
    : model_(&model),
      stencil_(stencil(options.scheme)),
      n_(options.points),
      width_(sensitivities ? 1 + model.parameter_count() : 1),
      columns_(width_ + stencil_.reach) {
  const auto values = static_cast<std::size_t>(n_ * kLanes);
  for (AlignedVector* array : {&z_, &v_, &a_, &x_, &g_, &g_u_, &g_v_, &g_a_})
    array->resize(values);
  const auto p = static_cast<std::size_t>(model.parameter_count());
  g_theta_.resize(values * p);
  left_.push_back(g_.data());
  for (std::size_t k = 0; k < p; ++k)
    left_.push_back(g_theta_.data() + k * values);
  rows_.resize(values * static_cast<std::size_t>(columns_));
  upper_.resize(values * static_cast<std::size_t>(stencil_.reach));
  theta_.resize(kLanes * p);
  rate_.assign(kLanes, 1.0);
  kappa_theta_.resize(kLanes * p);
  own_kappa_.resize(p);
  own_theta_.resize(p);
  if (options.correct_reversals && model.has_velocity_kink())
    reversals_ = std::make_unique<LaneReversals>(stencil_, n_, width_ - 1, columns_);
}

void PeriodicLanes::set_excitation(int lane, const PeriodicSystem& system) {
  set_frequency(lane, system.frequency());
  const auto x = system.excitation();
  for (int i = 0; i < n_; ++i)
    x_[static_cast<std::size_t>(kLanes * i + lane)] = x[static_cast<std::size_t>(i)];
}

void PeriodicLanes::set_frequency(int lane, double frequency_hz) {
  rate_[static_cast<std::size_t>(lane)] = frequency_hz * n_;
}

void PeriodicLanes::begin() {
  rows_hold_sensitivities_ = false;
  if (reversals_) reversals_->forget();
}

unsigned PeriodicLanes::linearise(unsigned moving) {
  difference_lanes(n_, stencil_, *as_lanes(rate_.data()), as_lanes(z_.data()), as_lanes(v_.data()),
                   as_lanes(a_.data()));
  const Lanes& rate = *as_lanes(rate_.data());
  Lanes kappa{};
  for (std::size_t lane = 0; reversals_ && lane < kLanes; ++lane) {
    if ((moving >> lane & 1U) != 0) kappa[lane] = model_->velocity_kink(theta_of(lane).data());
  }
  if (reversals_)
    reversals_->correct_state(kappa, rate, moving, as_lanes(v_.data()), as_lanes(a_.data()));
  const double* const u = z_.data();
  const double* const v = v_.data();
  const double* const a = a_.data();
  double* const g = g_.data();
  double* const g_u = g_u_.data();
  double* const g_v = g_v_.data();
  double* const g_a = g_a_.data();
  ModelPoints points;
  points.n = n_ * kLanes;
  points.u = &u;
  points.v = &v;
  points.a = &a;
  points.x = x_.data();
  const ModelForces forces{&g, &g_u, &g_v, &g_a, left_.data() + 1, nullptr};
  const unsigned sound = model_->evaluate_lanes(points, theta_.data(), forces);
  if (reversals_)
    reversals_->learn_slopes(moving, as_lanes(g_u_.data()), as_lanes(g_v_.data()),
                             as_lanes(g_a_.data()), as_lanes(v_.data()));
  return sound & kAllLanes;
}

std::span<double> PeriodicLanes::theta_of(std::size_t lane) {
  for (std::size_t k = 0; k < own_theta_.size(); ++k)
    own_theta_[k] = theta_[kLanes * k + lane];
  return own_theta_;
}

void PeriodicLanes::learn_jumps(unsigned moving) {
  if (!reversals_ || width_ == 1 || !rows_hold_sensitivities_) return;
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    if ((moving >> lane & 1U) == 0) continue;
    model_->velocity_kink_gradient(theta_of(lane), own_kappa_.data());
    for (std::size_t k = 0; k < own_kappa_.size(); ++k)
      kappa_theta_[kLanes * k + lane] = own_kappa_[k];
  }
  reversals_->learn_sensitivities(moving, as_lanes(rows_.data()), as_lanes(kappa_theta_.data()));
}

void PeriodicLanes::correct_jumps(unsigned moving) {
  if (!reversals_ || width_ == 1) return;
  learn_jumps(moving);
  reversals_->correct_left(moving, as_lanes(g_v_.data()), as_lanes(g_a_.data()), left_.data() + 1);
}

unsigned PeriodicLanes::solve_step(unsigned moving) {
  correct_jumps(moving);
  rows_hold_sensitivities_ = true;
  LaneStep step;
  step.n = n_;
  step.width = width_;
  step.stencil = stencil_;
  step.rate = *as_lanes(rate_.data());
  step.g_u = as_lanes(g_u_.data());
  step.g_v = as_lanes(g_v_.data());
  step.g_a = as_lanes(g_a_.data());
  step.left = left_.data();
  step.upper = as_lanes(upper_.data());
  step.rows = as_lanes(rows_.data());
  return solve_lane_step(step);
}

void PeriodicLanes::sum_products(const double* data, int count, int every, double* products) const {
  sum_lane_products({count, every, width_, columns_, as_lanes(rows_.data()), as_lanes(z_.data()),
                     as_lanes(data), as_lanes(products)});
}

void PeriodicLanes::advance(const double* delta, double* newton_step, unsigned moving) {
  Lanes share;
  for (int lane = 0; lane < kLanes; ++lane)
    share[lane] = (moving >> lane & 1U) != 0 ? 1.0 : 0.0;
  advance_lanes({n_, width_, columns_, as_lanes(rows_.data()), as_lanes(delta), &share,
                 as_lanes(z_.data()), as_lanes(newton_step)});
}

void PeriodicLanes::give(int lane, PeriodicSystem& system) const {
  const auto from = static_cast<std::size_t>(lane);
  system.begin();
  for (int i = 0; i < n_; ++i) {
    const auto at = static_cast<std::size_t>(i) * kLanes + from;
    system.put(i, z_[at], v_[at], a_[at],
               &rows_[static_cast<std::size_t>(i * columns_) * kLanes + from], kLanes);
  }
}

}  // namespace shaker::estimator
