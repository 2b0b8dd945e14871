#include "estimator/periodic/periodic_lanes.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/periodic/lane_step.hpp"

namespace shaker::estimator {

bool PeriodicLanes::possible(const Model& model, const GridOptions& options) {
  return model.lanes_possible() && options.scheme != Scheme::fourier;
}

PeriodicLanes::PeriodicLanes(const Model& model, const GridOptions& options)
    : model_(&model),
      stencil_(stencil(options.scheme)),
      correct_kink_(options.correct_kink && model.has_velocity_kink()),
      n_(options.points),
      p_(model.parameter_count()),
      columns_(1 + p_ + stencil_.reach) {
  const auto values = static_cast<std::size_t>(n_ * kLanes);
  for (AlignedVector* array : {&z_, &v_, &a_, &x_, &g_, &g_u_, &g_v_, &g_a_})
    array->resize(values);
  const auto p = static_cast<std::size_t>(p_);
  g_theta_.resize(values * p);
  for (std::size_t k = 0; k < p; ++k)
    columns_of_theta_.push_back(g_theta_.data() + k * values);
  rows_.resize(values * static_cast<std::size_t>(columns_));
  upper_.resize(values * static_cast<std::size_t>(stencil_.reach));
  theta_.resize(kLanes * p);
  rate_.assign(kLanes, 1.0);
  kappa_theta_.resize((p + kLanes) / kLanes * kLanes);
  own_theta_.resize(p);
  if (!correct_kink_) return;
  for (int lane = 0; lane < kLanes; ++lane)
    kinks_.emplace_back(stencil_, n_, p_, KinkLayout{kLanes, kLanes * columns_, kLanes});
}

void PeriodicLanes::set_excitation(int lane, const PeriodicSystem& system) {
  rate_[static_cast<std::size_t>(lane)] = system.frequency() * n_;
  const auto x = system.excitation();
  for (int i = 0; i < n_; ++i)
    x_[static_cast<std::size_t>(kLanes * i + lane)] = x[static_cast<std::size_t>(i)];
}

void PeriodicLanes::begin() {
  rows_hold_sensitivities_ = false;
  for (KinkCorrection& kinks : kinks_)
    kinks.forget();
}

// Four-point Lagrange, as in PeriodicSystem.
void PeriodicLanes::interpolate_from(const PeriodicLanes& coarser) {
  rows_hold_sensitivities_ = false;
  for (std::size_t lane = 0; lane < kinks_.size(); ++lane)
    kinks_[lane].inherit(coarser.kinks_[lane]);
  const int m = coarser.n_;
  const Lanes* from = as_lanes(coarser.z_.data());
  Lanes* to = as_lanes(z_.data());
  for (int i = 0; i < n_; ++i) {
    const double at = static_cast<double>(i) * m / n_;
    const int j = static_cast<int>(at);
    const double t = at - j;
    const double w[4] = {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2,
                         -(t + 1) * t * (t - 2) / 2, (t + 1) * t * (t - 1) / 6};
    to[i] = Lanes{};
    for (int k = 0; k < 4; ++k)
      to[i] += w[k] * from[(j - 1 + k + m) % m];
  }
}

unsigned PeriodicLanes::linearise(unsigned moving) {
  difference_lanes(n_, stencil_, *as_lanes(rate_.data()), as_lanes(z_.data()), as_lanes(v_.data()),
                   as_lanes(a_.data()));
  for (std::size_t lane = 0; lane < kinks_.size(); ++lane) {
    if ((moving >> lane & 1U) == 0) continue;
    for (std::size_t k = 0; k < own_theta_.size(); ++k)
      own_theta_[k] = theta_[kLanes * k + lane];
    kinks_[lane].correct_state(model_->velocity_kink(own_theta_.data()), rate_[lane], &v_[lane],
                               &a_[lane]);
  }
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
  const ModelForces forces{&g, &g_u, &g_v, &g_a, columns_of_theta_.data(), nullptr};
  const unsigned sound = model_->evaluate_lanes(points, theta_.data(), forces);
  for (std::size_t lane = 0; lane < kinks_.size(); ++lane) {
    if ((moving >> lane & 1U) != 0)
      kinks_[lane].learn_slopes(&g_u_[lane], &g_v_[lane], &g_a_[lane], &v_[lane]);
  }
  return sound & kAllLanes;
}

void PeriodicLanes::fill_right_hand_sides(unsigned moving) {
  for (std::size_t lane = 0; rows_hold_sensitivities_ && lane < kinks_.size(); ++lane) {
    if ((moving >> lane & 1U) == 0 || !kinks_[lane].any()) continue;
    for (std::size_t k = 0; k < own_theta_.size(); ++k)
      own_theta_[k] = theta_[kLanes * k + lane];
    model_->velocity_kink_gradient(own_theta_, &kappa_theta_[1]);
    kinks_[lane].learn_sensitivities(&rows_[lane], kappa_theta_.data());
  }
  Lanes* row = as_lanes(rows_.data());
  const Lanes* g = as_lanes(g_.data());
  for (int i = 0; i < n_; ++i, row += columns_) {
    row[0] = -g[i];
    for (std::size_t k = 0; k < columns_of_theta_.size(); ++k)
      row[1 + k] = -as_lanes(columns_of_theta_[k])[i];
  }
  for (std::size_t lane = 0; lane < kinks_.size(); ++lane) {
    if ((moving >> lane & 1U) != 0)
      kinks_[lane].correct_right_hand_sides(&g_v_[lane], &g_a_[lane], &rows_[lane]);
  }
}

unsigned PeriodicLanes::solve_step(unsigned moving) {
  fill_right_hand_sides(moving);
  rows_hold_sensitivities_ = true;
  LaneStep step;
  step.n = n_;
  step.width = 1 + p_;
  step.stencil = stencil_;
  step.rate = *as_lanes(rate_.data());
  step.g_u = as_lanes(g_u_.data());
  step.g_v = as_lanes(g_v_.data());
  step.g_a = as_lanes(g_a_.data());
  step.upper = as_lanes(upper_.data());
  step.rows = as_lanes(rows_.data());
  return solve_lane_step(step);
}

void PeriodicLanes::sum_products(const double* data, int count, int every, double* products) const {
  sum_lane_products({count, every, 1 + p_, columns_, as_lanes(rows_.data()), as_lanes(z_.data()),
                     as_lanes(data), as_lanes(products)});
}

void PeriodicLanes::advance(const double* delta, double* newton_step, unsigned moving) {
  Lanes share;
  for (int lane = 0; lane < kLanes; ++lane)
    share[lane] = (moving >> lane & 1U) != 0 ? 1.0 : 0.0;
  advance_lanes({n_, 1 + p_, columns_, as_lanes(rows_.data()), as_lanes(delta), &share,
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
