#include "estimator/time/state_equations.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace shaker::estimator {
namespace {

constexpr int kNewtonSteps = 12;     // for effects that are not linear in acceleration
constexpr double kSolved = 1e-13;    // change of q, relative, at which Newton has converged
constexpr double kSingular = 1e-14;  // smallest pivot, relative to the matrix's largest entry
constexpr int kProbes = 3;           // states at which derivatives_know_accelerations() evaluates

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
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
  const int c = coordinates_;
  work.lanes = n;
  work.at.shape(model_, n);
  work.matrix.resize(index(c * c));
  work.column.resize(index(c));
  work.pivot.resize(index(c));
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
  once_ = states_ == 2 * c && !derivatives_know_accelerations();
}

// Tests if the model's derivatives change with the accelerations, at its start parameters in some
// states near rest. Returns true also if such a state is inadmissible.
bool StateEquations::derivatives_know_accelerations() const {
  const int c = coordinates_;
  Workspace work;
  reserve(1, work);
  const auto theta = model_.start();
  const double x = 0.0;
  for (int probe = 0; probe < kProbes; ++probe) {
    std::vector<double> first;
    for (int side = 0; side < 2; ++side) {
      for (int e = 0; e < c; ++e) {
        *work.at.u[index(e)] = model_.rest(e) + 1e-3 * (probe + e);
        *work.at.v[index(e)] = 0.1 * (probe - 1) + 0.02 * e;
        *work.at.a[index(e)] = side == 0 ? 0.0 : 0.7 + 0.3 * e;
      }
      if (!work.at.evaluate(model_, 1, theta.data(), &x)) return true;
      std::vector<double> now;
      for (const auto* arrays : {&work.at.g_u, &work.at.g_v, &work.at.g_a, &work.at.g_theta}) {
        for (const double* array : *arrays)
          now.push_back(*array);
      }
      if (side == 1 && now != first) return true;
      first = std::move(now);
    }
  }
  return false;
}

bool StateEquations::evaluate(int n, const double* const* s, const double* x, const double* theta,
                              Workspace& work) const {
  const int c = coordinates_;
  for (int e = 0; e < c; ++e) {
    std::copy_n(s[e], n, work.at.u[index(e)]);
    if (velocity_of(e) >= 0) std::copy_n(s[velocity_of(e)], n, work.at.v[index(e)]);
  }
  if (!work.at.evaluate(model_, n, theta, x)) return false;
  for (int d = 0; d < c; ++d) {
    if (force_[index(d)] == 0.0) continue;
    for (int i = 0; i < n; ++i)
      work.at.g[index(d)][i] -= force_[index(d)];
  }
  return true;
}

// LU factorisation of g_q with partial pivoting in one lane; false when it is singular.
bool StateEquations::factor(int lane, Workspace& work) const {
  const int c = coordinates_;
  auto& m = work.matrix;
  double largest = 0.0;
  for (int d = 0; d < c; ++d) {
    for (int e = 0; e < c; ++e) {
      const auto& part = velocity_of(e) >= 0 ? work.at.g_a : work.at.g_v;
      m[index(d * c + e)] = part[index(d * c + e)][lane];
      largest = std::max(largest, std::fabs(m[index(d * c + e)]));
    }
  }
  for (int k = 0; k < c; ++k) {
    int best = k;
    for (int d = k + 1; d < c; ++d) {
      if (std::fabs(m[index(d * c + k)]) > std::fabs(m[index(best * c + k)])) best = d;
    }
    work.pivot[index(k)] = best;
    if (!(std::fabs(m[index(best * c + k)]) > kSingular * largest)) return false;
    if (best != k) std::swap_ranges(&m[index(k * c)], &m[index(k * c)] + c, &m[index(best * c)]);
    for (int d = k + 1; d < c; ++d) {
      const double factor = m[index(d * c + k)] /= m[index(k * c + k)];
      for (int e = k + 1; e < c; ++e)
        m[index(d * c + e)] -= factor * m[index(k * c + e)];
    }
  }
  return true;
}

void StateEquations::substitute(Workspace& work) const {
  const int c = coordinates_;
  const auto& m = work.matrix;
  auto& b = work.column;
  for (int k = 0; k < c; ++k) {
    std::swap(b[index(k)], b[index(work.pivot[index(k)])]);
    for (int d = k + 1; d < c; ++d)
      b[index(d)] -= m[index(d * c + k)] * b[index(k)];
  }
  for (int k = c; k-- > 0;) {
    for (int e = k + 1; e < c; ++e)
      b[index(k)] -= m[index(k * c + e)] * b[index(e)];
    b[index(k)] /= m[index(k * c + k)];
  }
}

// Makes one Newton step on q in every lane. Returns the largest change and the largest |q|.
bool StateEquations::solve_lanes(int n, Workspace& work, double* largest, double* scale) const {
  const int c = coordinates_;
  *largest = *scale = 0.0;
  for (int i = 0; i < n; ++i) {
    if (!factor(i, work)) return false;
    for (int d = 0; d < c; ++d)
      work.column[index(d)] = -work.at.g[index(d)][i];
    substitute(work);
    for (int e = 0; e < c; ++e) {
      double& q = velocity_of(e) >= 0 ? work.at.a[index(e)][i] : work.at.v[index(e)][i];
      q += work.column[index(e)];
      *largest = std::max(*largest, std::fabs(work.column[index(e)]));
      *scale = std::max(*scale, std::fabs(q));
    }
  }
  return std::isfinite(*scale);
}

void StateEquations::derivatives(int n, Workspace& work, double* const* h_s,
                                 double* const* h_theta) const {
  const int c = coordinates_, m = states_, p = parameters();
  const auto write = [&](int column, int columns, double* const* into, int lane) {
    for (int e = 0; e < c; ++e) {
      const int row = velocity_of(e) >= 0 ? velocity_of(e) : e;
      into[row * columns + column][lane] = work.column[index(e)];
    }
  };
  for (int e = 0; e < c; ++e) {
    if (velocity_of(e) < 0) continue;
    for (int k = 0; h_s != nullptr && k < m; ++k)
      std::fill_n(h_s[e * m + k], n, k == velocity_of(e) ? 1.0 : 0.0);
    for (int k = 0; h_theta != nullptr && k < p; ++k)
      std::fill_n(h_theta[e * p + k], n, 0.0);
  }
  for (int i = 0; i < n; ++i) {
    factor(i, work);
    for (int k = 0; h_s != nullptr && k < c; ++k) {
      for (int d = 0; d < c; ++d)
        work.column[index(d)] = -work.at.g_u[index(d * c + k)][i];
      substitute(work);
      write(k, m, h_s, i);
      if (velocity_of(k) < 0) continue;
      for (int d = 0; d < c; ++d)
        work.column[index(d)] = -work.at.g_v[index(d * c + k)][i];
      substitute(work);
      write(velocity_of(k), m, h_s, i);
    }
    for (int k = 0; h_theta != nullptr && k < p; ++k) {
      for (int d = 0; d < c; ++d)
        work.column[index(d)] = -work.at.g_theta[index(d * p + k)][i];
      substitute(work);
      write(k, p, h_theta, i);
    }
  }
}

bool StateEquations::rates(int n, const double* const* s, const double* x, const double* theta,
                           Workspace& work, double* const* rate, double* const* h_s,
                           double* const* h_theta) const {
  reserve(n, work);
  const int c = coordinates_;
  for (int e = 0; e < c; ++e) {
    std::fill_n(work.at.a[index(e)], n, 0.0);
    if (velocity_of(e) < 0) std::fill_n(work.at.v[index(e)], n, 0.0);
  }
  if (!evaluate(n, s, x, theta, work)) return false;

  if (c == 1 && once_) {  // one coordinate (the oleo): no matrices
    const double* g = work.at.g[0];
    const double* g_a = work.at.g_a[0];
    if (std::count(g_a, g_a + n, 0.0) > 0) return false;  // no inertia: no acceleration
    std::copy_n(s[1], n, rate[0]);
    for (int i = 0; i < n; ++i)
      rate[1][i] = -g[i] / g_a[i];
    if (h_s != nullptr) {
      std::fill_n(h_s[0], n, 0.0);
      std::fill_n(h_s[1], n, 1.0);
      for (int i = 0; i < n; ++i) {
        h_s[2][i] = -work.at.g_u[0][i] / g_a[i];
        h_s[3][i] = -work.at.g_v[0][i] / g_a[i];
      }
    }
    const int p = parameters();
    for (int k = 0; h_theta != nullptr && k < p; ++k) {
      std::fill_n(h_theta[k], n, 0.0);
      const double* column = work.at.g_theta[index(k)];
      for (int i = 0; i < n; ++i)
        h_theta[p + k][i] = -column[i] / g_a[i];
    }
    return true;
  }

  double change = 0.0, scale = 0.0;
  for (int step = 0; step < kNewtonSteps; ++step) {
    if (!solve_lanes(n, work, &change, &scale)) return false;
    if (once_ || change <= kSolved * scale) break;
    // Evaluates again at the new q, because the derivatives may depend on it.
    if (!evaluate(n, s, x, theta, work)) return false;
  }
  for (int e = 0; e < c; ++e) {
    if (velocity_of(e) >= 0) {
      std::copy_n(s[velocity_of(e)], n, rate[e]);
      std::copy_n(work.at.a[index(e)], n, rate[velocity_of(e)]);
    } else {
      std::copy_n(work.at.v[index(e)], n, rate[e]);
    }
  }
  if (h_s != nullptr || h_theta != nullptr) derivatives(n, work, h_s, h_theta);
  return true;
}

}  // namespace shaker::estimator
