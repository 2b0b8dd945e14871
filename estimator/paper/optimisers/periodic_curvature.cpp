// Second-order sensitivities of the periodic solution, and their sum Q of (4.4).
#include <algorithm>
#include <cmath>

#include "estimator/model/model_arrays.hpp"
#include "estimator/paper/optimisers/periodic_problem.hpp"

namespace shaker::estimator::optimisers {
namespace {

constexpr double kStep = 2e-5;  // of the differences, relative to the parameter

// Sensitivities of stroke, velocity and acceleration to one parameter, at index
// point * s + coordinate.
struct Tangent {
  std::vector<double> u, v, a;
};

Tangent tangent(const PeriodicSystem& system, int parameter) {
  const int n = system.points(), s = system.model().coordinates();
  const Stencil difference = stencil(system.options().scheme);
  const double rate = system.frequency() * n;
  Tangent t;
  const auto size = static_cast<std::size_t>(n * s);
  t.u.resize(size);
  t.v.resize(size);
  t.a.resize(size);
  const auto value = [&](int i, int c) {
    return system.row((i + n) % n, c)[static_cast<std::size_t>(1 + parameter)];
  };
  for (int i = 0; i < n; ++i) {
    for (int c = 0; c < s; ++c) {
      const auto at = static_cast<std::size_t>(i * s + c);
      t.u[at] = value(i, c);
      for (int k = -difference.reach; k <= difference.reach; ++k) {
        const auto tap = static_cast<std::size_t>(k + difference.reach);
        t.v[at] += rate * difference.first[tap] * value(i + k, c);
        t.a[at] += rate * rate * difference.second[tap] * value(i + k, c);
      }
    }
  }
  return t;
}

// Derivative of equation d at point i along the tangent, plus that to the parameter itself.
double slope_along(const ModelArrays& at, const Tangent& t, int parameter, int i, int d, int s,
                   int p) {
  double slope = at.g_theta[d * p + parameter][i];
  for (int c = 0; c < s; ++c) {
    const auto index = static_cast<std::size_t>(i * s + c);
    slope += at.g_u[d * s + c][i] * t.u[index] + at.g_v[d * s + c][i] * t.v[index] +
             at.g_a[d * s + c][i] * t.a[index];
  }
  return slope;
}

// The solution, moved by `by` along the tangent.
void move_along(const PeriodicSystem& system, const Tangent& t, double by, ModelArrays& at) {
  const int n = system.points(), s = system.model().coordinates();
  for (int i = 0; i < n; ++i) {
    for (int c = 0; c < s; ++c) {
      const auto index = static_cast<std::size_t>(i * s + c);
      at.u[c][i] = system.value(i, c) + by * t.u[index];
      at.v[c][i] = system.velocity(i, c) + by * t.v[index];
      at.a[c][i] = system.acceleration(i, c) + by * t.a[index];
    }
  }
}

}  // namespace

bool PeriodicProblem::add_curvature(std::size_t r, const std::vector<double>& theta,
                                    const double* e, Eigen::MatrixXd& q) {
  PeriodicSystem& system = systems_[r];
  const int n = system.points(), s = model_.coordinates(), p = model_.parameter_count();
  const int count = parameters();
  const int pairs = count * (count + 1) / 2;
  std::vector<Tangent> tangents;
  for (const int k : free_)
    tangents.push_back(tangent(system, k));
  std::vector<double> rows(static_cast<std::size_t>(n * s * pairs), 0.0);
  ModelArrays at;  // separate from those of the system
  at.shape(model_, n);
  std::vector<double> moved = theta;
  int first_pair = 0;
  for (int l = 0; l < count; ++l) {
    const Tangent& w = tangents[static_cast<std::size_t>(l)];
    const auto own = static_cast<std::size_t>(free_[l]);
    const double step = kStep * std::max(std::fabs(theta[own]), 1e-6);
    // f' = (8 (f(h) - f(-h)) - (f(2h) - f(-2h))) / 12 h
    for (const auto& [shift, weight] :
         {std::pair{1.0, 8.0}, {-1.0, -8.0}, {2.0, -1.0}, {-2.0, 1.0}}) {
      moved[own] = theta[own] + shift * step;
      move_along(system, w, shift * step, at);
      if (!at.evaluate(model_, n, moved.data())) return false;
      const double factor = -weight / (12.0 * step);  // right-hand side: minus the derivative
      for (int k = 0; k <= l; ++k) {
        const Tangent& t = tangents[static_cast<std::size_t>(k)];
        for (int i = 0; i < n; ++i) {
          for (int d = 0; d < s; ++d) {
            rows[static_cast<std::size_t>((i * s + d) * pairs + first_pair + k)] +=
                factor * slope_along(at, t, free_[k], i, d, s, p);
          }
        }
      }
    }
    moved[own] = theta[own];
    first_pair += l + 1;
  }
  if (!system.factorise()) return false;
  system.solve_factorised(rows, pairs);
  const Run& run = runs_[r];
  const int c = model_.observed();
  for (std::size_t j = 0; j < run.readings.size(); ++j) {
    const GridReading& reading = run.readings[j];
    for (int m = 0; m < reading.count; ++m) {
      const int point = (reading.base + m) % n;
      const double* second = &rows[static_cast<std::size_t>((point * s + c) * pairs)];
      const double weight = run.scale[j] * reading.weight[m] * e[j];
      for (int l = 0, pair = 0; l < count; ++l) {
        for (int k = 0; k <= l; ++k, ++pair)
          q(k, l) -= weight * second[pair];
      }
    }
  }
  for (int l = 0; l < count; ++l) {
    for (int k = 0; k < l; ++k)
      q(l, k) = q(k, l);
  }
  return true;
}

}  // namespace shaker::estimator::optimisers
