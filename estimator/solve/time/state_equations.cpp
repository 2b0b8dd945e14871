#include "estimator/solve/time/state_equations.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/math/simd_math.hpp"

namespace shaker::estimator {
namespace {

constexpr int kNewtonSteps = 24;   // an orifice near rest overshoots, then halves each step
constexpr double kSolved = 1e-13;  // change of q, relative, at which Newton has converged
constexpr int kProbes = 3;         // states at which derivatives_know_rates() evaluates

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

// to = -from / g_a, for `count` arrays; false where g_a is 0. `over` is scratch.
SHAKER_SIMD_CLONES bool over_inertia(int n, const double* __restrict g_a, double* __restrict over,
                                     int count, const double* const* from, double* const* to) {
  int none = 0;
  for (int i = 0; i < n; ++i) {
    none += g_a[i] == 0.0 ? 1 : 0;
    over[i] = -1.0 / g_a[i];
  }
  for (int k = 0; k < count; ++k) {
    const double* __restrict one = from[k];
    double* __restrict other = to[k];
    for (int i = 0; i < n; ++i)
      other[i] = over[i] * one[i];
  }
  return none == 0;
}

// q += change; raises `largest` to the largest change, `size` to the largest |q|. False where a q is
// not finite.
SHAKER_SIMD_CLONES bool move_unknown(int n, const double* __restrict change, double* __restrict q,
                                     double& largest, double& size) {
  double moved = largest, widest = size;
  int wild = 0;
  for (int i = 0; i < n; ++i) {
    q[i] += change[i];
    const double step = std::fabs(change[i]), value = std::fabs(q[i]);
    moved = step > moved ? step : moved;
    widest = value > widest ? value : widest;
    wild += value < std::numeric_limits<double>::infinity() ? 0 : 1;
  }
  largest = moved;
  size = widest;
  return wild == 0;
}

}  // namespace

StateEquations::StateEquations(const Model& model, std::vector<double> force)
    : model_(model), force_(std::move(force)), coordinates_(model.coordinates()) {
  if (force_.empty()) force_.assign(index(coordinates_), 0.0);
  if (force_.size() != index(coordinates_))
    throw std::invalid_argument(fmt::format("{} constant forces for {} equations of model '{}'",
                                            force_.size(), coordinates_, model.name()));
  if (model.needs_carrier())
    throw std::invalid_argument(fmt::format(
        "model '{}' has an effect of the exciter that only a periodic excitation has (its "
        "harmonics, its phase); leave it out of a model that is integrated in time",
        model.name()));
  find_kinds();
}

void StateEquations::reserve(int n, Workspace& work) const {
  if (n <= work.lanes) return;
  work.lanes = n;
  work.at.shape(model_, n);
  work.inverse.shape(n, coordinates_);
  work.change.resize((index(n) + 7) / 8 * 8);
}

void StateEquations::find_kinds() {
  const int c = coordinates_;
  states_ = c;
  velocity_.assign(index(c), -1);
  for (int e = 0; e < c; ++e) {
    names_.push_back(model_.coordinate_name(e));
    if (model_.order(e) > 1) velocity_[index(e)] = states_++;
  }
  for (int e = 0; e < c; ++e) {
    if (velocity_of(e) >= 0) names_.push_back(names_[index(e)] + "'");
  }
  once_ = !derivatives_know_rates();
}

// Tests if the model's derivatives change with the accelerations, or with the rates of coordinates
// without mass, at its start parameters in some states near rest. Returns true also if such a state
// is inadmissible.
bool StateEquations::derivatives_know_rates() const {
  const int c = coordinates_;
  Workspace work;
  reserve(1, work);
  const auto theta = model_.start();
  const double x = 0.0;
  for (int probe = 0; probe < kProbes; ++probe) {
    std::vector<double> first;
    for (const int side : {0, 1, -1}) {
      for (int e = 0; e < c; ++e) {
        const double unknown = side * (0.7 + 0.3 * e);
        *work.at.u[index(e)] = model_.rest(e) + 1e-3 * (probe + e);
        *work.at.v[index(e)] = velocity_of(e) >= 0 ? 0.1 * (probe - 1) + 0.02 * e : unknown;
        *work.at.a[index(e)] = unknown;
      }
      if (!work.at.evaluate(model_, 1, theta.data(), &x)) return true;
      std::vector<double> now;
      for (const auto* arrays : {&work.at.g_u, &work.at.g_v, &work.at.g_a, &work.at.g_theta}) {
        for (const double* array : *arrays)
          now.push_back(*array);
      }
      if (side != 0 && now != first) return true;
      first = std::move(now);
    }
  }
  return false;
}

bool StateEquations::evaluate(int n, const double* const* s, const double* x, const double* theta,
                              bool slopes, Workspace& work) const {
  const int c = coordinates_;
  work.v.assign(work.at.v.begin(), work.at.v.end());
  for (int e = 0; e < c; ++e) {
    if (velocity_of(e) >= 0) work.v[index(e)] = s[velocity_of(e)];
  }
  if (!work.at.evaluate(model_, n, theta, x, s, work.v.data(), slopes)) return false;
  for (int d = 0; d < c; ++d) {
    if (force_[index(d)] == 0.0) continue;
    for (int i = 0; i < n; ++i)
      work.at.g[index(d)][i] -= force_[index(d)];
  }
  return true;
}

// The inverse of g_q in every lane; false where it is singular.
bool StateEquations::invert(int n, Workspace& work) const {
  const int c = coordinates_;
  for (int d = 0; d < c; ++d) {
    for (int e = 0; e < c; ++e) {
      const auto& part = velocity_of(e) >= 0 ? work.at.g_a : work.at.g_v;
      std::copy_n(part[index(d * c + e)], n, work.inverse.entry(d, e));
    }
  }
  return work.inverse.invert(n);
}

// Makes one Newton step on q in every lane. Returns the largest change and the largest |q|.
bool StateEquations::solve_lanes(int n, Workspace& work, double* largest, double* scale) const {
  *largest = *scale = 0.0;
  if (!invert(n, work)) return false;
  for (int e = 0; e < coordinates_; ++e) {
    double* change = work.change.data();
    work.inverse.times(n, e, work.at.g.data(), 1, -1.0, change);
    double* q = velocity_of(e) >= 0 ? work.at.a[index(e)] : work.at.v[index(e)];
    if (!move_unknown(n, change, q, *largest, *scale)) return false;
  }
  return true;
}

// `work.inverse` belongs to the last Newton step.
void StateEquations::derivatives(int n, Workspace& work, double* const* h_s,
                                 double* const* h_theta) const {
  const int c = coordinates_, m = states_, p = parameters();
  for (int e = 0; e < c; ++e) {
    if (velocity_of(e) < 0) continue;
    for (int k = 0; h_s != nullptr && h_s[e * m] != nullptr && k < m; ++k)
      std::fill_n(h_s[e * m + k], n, k == velocity_of(e) ? 1.0 : 0.0);
    for (int k = 0; h_theta != nullptr && k < p && h_theta[e * p] != nullptr; ++k)
      std::fill_n(h_theta[e * p + k], n, 0.0);
  }
  for (int e = 0; e < c; ++e) {
    const int row = velocity_of(e) >= 0 ? velocity_of(e) : e;
    for (int k = 0; h_s != nullptr && k < c; ++k) {
      work.inverse.times(n, e, &work.at.g_u[index(k)], c, -1.0, h_s[row * m + k]);
      if (velocity_of(k) >= 0)
        work.inverse.times(n, e, &work.at.g_v[index(k)], c, -1.0, h_s[row * m + velocity_of(k)]);
    }
    for (int k = 0; h_theta != nullptr && k < p; ++k)
      work.inverse.times(n, e, &work.at.g_theta[index(k)], p, -1.0, h_theta[row * p + k]);
  }
}

// Of one coordinate (the oleo), from its evaluation: no matrices.
bool StateEquations::single_rates(int n, const double* const* s, Workspace& work,
                                  double* const* rate, double* const* h_s,
                                  double* const* h_theta) const {
  const int p = parameters();
  if (rate[0] != nullptr) std::copy_n(s[1], n, rate[0]);
  work.from.assign({work.at.g[0]});
  work.to.assign({rate[1]});
  if (h_s != nullptr) {
    work.from.insert(work.from.end(), {work.at.g_u[0], work.at.g_v[0]});
    work.to.insert(work.to.end(), {h_s[2], h_s[3]});
    for (int k = 0; k < 2 && h_s[k] != nullptr; ++k)
      std::fill_n(h_s[k], n, k);
  }
  for (int k = 0; h_theta != nullptr && k < p; ++k) {
    work.from.push_back(work.at.g_theta[index(k)]);
    work.to.push_back(h_theta[p + k]);
    if (h_theta[k] != nullptr) std::fill_n(h_theta[k], n, 0.0);
  }
  return over_inertia(n, work.at.g_a[0], work.change.data(), static_cast<int>(work.from.size()),
                      work.from.data(), work.to.data());  // false: no inertia, no acceleration
}

bool StateEquations::rates(int n, const double* const* s, const double* x, const double* theta,
                           Workspace& work, double* const* rate, double* const* h_s,
                           double* const* h_theta) const {
  reserve(n, work);
  const int c = coordinates_;
  for (int e = 0; e < c; ++e) {
    if (c > 1 || !once_) std::fill_n(work.at.a[index(e)], n, 0.0);
    if (velocity_of(e) < 0) std::fill_n(work.at.v[index(e)], n, 0.0);
  }
  const bool slopes = h_theta != nullptr;
  if (!evaluate(n, s, x, theta, slopes, work)) return false;

  if (c == 1 && states_ == 2 && once_) return single_rates(n, s, work, rate, h_s, h_theta);

  double change = 0.0, scale = 0.0;
  for (int step = 0; step < kNewtonSteps; ++step) {
    if (!solve_lanes(n, work, &change, &scale)) return false;
    if (once_ || change <= kSolved * scale) break;
    // Evaluates again at the new q, because the derivatives may depend on it.
    if (!evaluate(n, s, x, theta, slopes, work)) return false;
  }
  for (int e = 0; e < c; ++e) {
    if (velocity_of(e) >= 0) {
      if (rate[e] != nullptr) std::copy_n(s[velocity_of(e)], n, rate[e]);
      std::copy_n(work.at.a[index(e)], n, rate[velocity_of(e)]);
    } else {
      std::copy_n(work.at.v[index(e)], n, rate[e]);
    }
  }
  if (h_s != nullptr || h_theta != nullptr) derivatives(n, work, h_s, h_theta);
  return true;
}

}  // namespace shaker::estimator
