// Normal equations, and the step inside the bounds (the box).
#include <algorithm>
#include <cmath>

#include "estimator/fit/estimation_impl.hpp"
#include "estimator/math/box_minimum.hpp"

namespace shaker::estimator {
namespace {

constexpr int kFew = 8;  // up to this many parameters a step does not allocate
constexpr double kLeastPivot = 1e-13;

}  // namespace

void Estimator::Impl::accumulate(std::vector<PeriodicSystem>& level, bool with_newton) {
  const std::size_t size = 1 + fit.theta.size();
  std::fill(products.begin(), products.end(), 0.0);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const RunState& run = runs[r];
    const int every = &level == &coarse ? run.coarse_every : run.every;
    const bool plain = every > 0 && !run.harmonic() && run.data.sample_weight.empty();
    if (plain && level[r].add_products(run.data.displacement, every, with_newton,
                                       run.inverse_variance, products.data()))
      continue;
    for_each_datum(r, with_newton, [&](const double* row, double residual, double weight) {
      products[0] += weight * residual * residual;
      for (std::size_t k = 1; k < size; ++k) {
        products[k * size] += weight * row[k] * residual;
        for (std::size_t l = 1; l <= k; ++l)
          products[k * size + l] += weight * row[k] * row[l];
      }
    });
  }
  normal_equations();
}

void Estimator::Impl::normal_equations() {
  const std::size_t q = free.size();
  const std::size_t size = 1 + fit.theta.size();
  sum_of_squares = products[0];
  for (std::size_t k = 0; k < q; ++k) {
    const std::size_t row = static_cast<std::size_t>(1 + free[k]) * size;
    gradient[k] = products[row];
    for (std::size_t l = 0; l <= k; ++l)
      gram[k * q + l] = products[row + static_cast<std::size_t>(1 + free[l])];
  }
  if (priors) add_priors();
}

// Minimises the quadratic form of (gram + lambda diag) delta = gradient inside the bounds.
bool Estimator::Impl::box_step(double lambda) {
  const std::size_t q = free.size();
  const auto& parameters = model.parameters();
  for (std::size_t k = 0; k < q; ++k) {
    const ModelParameter& p = parameters[free[k]];
    const double theta = fit.theta[free[k]];
    held[k] = pinned[k] || (theta <= p.lower && gradient[k] < 0.0) ||
              (theta >= p.upper && gradient[k] > 0.0);
  }
  if (!solve_free(lambda)) return false;
  if (!stays_inside(lambda) &&
      !(q <= kFew ? box_minimum_step<kFew>(lambda) : box_minimum_step<Eigen::Dynamic>(lambda)))
    return false;
  std::fill(delta_full.begin(), delta_full.end(), 0.0);
  for (std::size_t k = 0; k < q; ++k)
    delta_full[free[k]] = delta[k];
  return true;
}

// Solves by Cholesky factorisation; held parameters do not move.
bool Estimator::Impl::solve_free(double lambda) {
  const std::size_t q = free.size();
  for (std::size_t k = 0; k < q; ++k) {
    delta[k] = held[k] ? 0.0 : gradient[k];
    for (std::size_t l = 0; l < k; ++l)
      factors[k * q + l] = held[k] || held[l] ? 0.0 : gram[k * q + l];
    factors[k * q + k] = held[k] ? 1.0 : (1.0 + lambda) * gram[k * q + k];
  }
  for (std::size_t k = 0; k < q; ++k) {
    const double diagonal = factors[k * q + k];
    double sum = diagonal;
    for (std::size_t m = 0; m < k; ++m)
      sum -= factors[k * q + m] * factors[k * q + m];
    if (!(sum > kLeastPivot * diagonal)) return false;
    const double inverse = 1.0 / std::sqrt(sum);
    factors[k * q + k] = inverse;  // of the diagonal of the factor
    for (std::size_t r = k + 1; r < q; ++r) {
      double value = factors[r * q + k];
      for (std::size_t m = 0; m < k; ++m)
        value -= factors[r * q + m] * factors[k * q + m];
      factors[r * q + k] = value * inverse;
    }
  }
  for (std::size_t k = 0; k < q; ++k) {
    for (std::size_t m = 0; m < k; ++m)
      delta[k] -= factors[k * q + m] * delta[m];
    delta[k] *= factors[k * q + k];
  }
  for (std::size_t k = q; k-- > 0;) {
    for (std::size_t r = k + 1; r < q; ++r)
      delta[k] -= factors[r * q + k] * delta[r];
    delta[k] *= factors[k * q + k];
  }
  return true;
}

// True if `delta` is already the minimum inside the bounds: no free parameter leaves them, and
// every held one would.
bool Estimator::Impl::stays_inside(double lambda) const {
  const std::size_t q = free.size();
  for (std::size_t k = 0; k < q; ++k) {
    if (pinned[k]) continue;
    const ModelParameter& p = model.parameters()[free[k]];
    const double theta = fit.theta[free[k]];
    if (!held[k]) {
      if (theta + delta[k] < p.lower || theta + delta[k] > p.upper) return false;
      continue;
    }
    double slope = gradient[k] - lambda * gram[k * q + k] * delta[k];
    for (std::size_t l = 0; l < q; ++l)
      slope -= gram[std::max(k, l) * q + std::min(k, l)] * delta[l];
    if (theta <= p.lower ? slope > 0.0 : slope < 0.0) return false;
  }
  return true;
}

template <int Most>
bool Estimator::Impl::box_minimum_step(double lambda) {
  const auto q = static_cast<Eigen::Index>(free.size());
  BoxVector<Most> scale(q), b(q), lower(q), upper(q), x(q);
  BoxMatrix<Most> a(q, q);
  for (Eigen::Index k = 0; k < q; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const ModelParameter& p = model.parameters()[free[at]];
    const double diagonal = gram[at * free.size() + at];
    scale[k] = diagonal > 0.0 ? std::sqrt(diagonal) : 1.0;
    b[k] = gradient[at] / scale[k];
    lower[k] = pinned[at] ? 0.0 : (p.lower - fit.theta[free[at]]) * scale[k];
    upper[k] = pinned[at] ? 0.0 : (p.upper - fit.theta[free[at]]) * scale[k];
    for (Eigen::Index l = 0; l <= k; ++l)
      a(k, l) = a(l, k) =
          gram[at * free.size() + static_cast<std::size_t>(l)] / (scale[k] * scale[l]);
    a(k, k) *= 1.0 + lambda;
  }
  if (!box_minimum<Most>(a, b, lower, upper, kLeastPivot, x)) return false;
  for (Eigen::Index k = 0; k < q; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const ModelParameter& p = model.parameters()[free[at]];
    const double theta = fit.theta[free[at]];
    delta[at] = x[k] <= lower[k]   ? p.lower - theta
                : x[k] >= upper[k] ? p.upper - theta
                                   : x[k] / scale[k];
    if (pinned[at]) delta[at] = 0.0;
  }
  return true;
}

// Largest step relative to the parameter before or after it, whichever is larger. A parameter that
// leaves a bound at zero thus has the relative step 1, not a huge one.
double Estimator::Impl::relative_step() const {
  double worst = 0.0;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const double theta = fit.theta[free[k]];
    const double size = std::max({std::fabs(theta), std::fabs(theta + delta[k]), 1e-12});
    worst = std::max(worst, std::fabs(delta[k]) / size);
  }
  return worst;
}

// The share of the step in which no parameter moves by more than `most` of its present or its
// starting value. Far from the optimum the linearisation moves badly determined parameters by
// orders of magnitude, into valleys from which the iteration returns slowly.
double Estimator::Impl::share_within(const std::vector<double>& start, double most) const {
  double share = 1.0;
  for (std::size_t k = 0; k < delta_full.size(); ++k) {
    const double size = most * std::max(std::fabs(fit.theta[k]), std::fabs(start[k]));
    if (std::fabs(delta_full[k]) * share > size && size > 0.0)
      share = size / std::fabs(delta_full[k]);
  }
  return share;
}

// Shortens the step to share_within(start, 1). Returns true if it did.
bool Estimator::Impl::cap_step(const std::vector<double>& start) {
  const double share = share_within(start, 1.0);
  for (double& d : delta_full)
    d *= share;
  for (double& d : delta)
    d *= share;
  return share < 1.0;
}

}  // namespace shaker::estimator
