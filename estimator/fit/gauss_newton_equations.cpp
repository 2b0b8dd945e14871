#include "estimator/fit/internal/gauss_newton_equations.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/math/box_minimum.hpp"

namespace shaker::estimator {
namespace {

constexpr int kFew = 8;  // up to this many parameters a step does not allocate
constexpr double kLeastPivot = 1e-13;

}  // namespace

GaussNewtonEquations::GaussNewtonEquations(const FitData& the_data) : data(the_data) {
  const std::size_t q = data.free.size();
  const auto p = static_cast<std::size_t>(data.model.parameter_count());
  gram.resize(q * q);
  factors_.resize(q * q);
  gradient.resize(q);
  delta.resize(q);
  held_.resize(q);
  pinned.resize(q);
  delta_full.resize(p);
  products.resize((1 + p) * (1 + p));
}

void GaussNewtonEquations::form(const std::vector<double>& theta) {
  const std::size_t q = data.free.size();
  const std::size_t size = 1 + theta.size();
  sum_of_squares = products[0];
  for (std::size_t k = 0; k < q; ++k) {
    const std::size_t row = static_cast<std::size_t>(1 + data.free[k]) * size;
    gradient[k] = products[row];
    for (std::size_t l = 0; l <= k; ++l)
      gram[k * q + l] = products[row + static_cast<std::size_t>(1 + data.free[l])];
  }
  if (data.priors) add_priors(theta);
}

// Normal priors (3.8). With noise variance s^2, -ln of the posterior is (SS(theta) + s^2 sum ((theta - m) / sigma)^2) /
// (2 s^2). A prior is therefore one more datum of weight s^2 / sigma^2. If s^2 is unknown, the
// present residuals give it. The objective is then (n - q) ln SS + the prior's sum, which has the
// same stationary points.
void GaussNewtonEquations::add_priors(const std::vector<double>& theta) {
  const double variance = data.noise_variance(sum_of_squares);
  if (!std::isfinite(variance)) return;
  const std::size_t q = data.free.size();
  for (std::size_t k = 0; k < q; ++k) {
    const ModelParameter& p = data.model.parameters()[static_cast<std::size_t>(data.free[k])];
    if (!p.prior_mean) continue;
    const double sigma = *p.prior_standard_deviation;
    const double weight = variance / (sigma * sigma);
    gram[k * q + k] += weight;
    gradient[k] += weight * (*p.prior_mean - theta[static_cast<std::size_t>(data.free[k])]);
  }
}

// Minimises the quadratic form of (gram + lambda diag) delta = gradient inside the bounds.
bool GaussNewtonEquations::step(const std::vector<double>& theta, double lambda) {
  const std::size_t q = data.free.size();
  const auto& parameters = data.model.parameters();
  for (std::size_t k = 0; k < q; ++k) {
    const ModelParameter& p = parameters[data.free[k]];
    const double now = theta[data.free[k]];
    held_[k] =
        pinned[k] || (now <= p.lower && gradient[k] < 0.0) || (now >= p.upper && gradient[k] > 0.0);
  }
  if (!solve_free(lambda)) return false;
  if (!stays_inside(theta, lambda) &&
      !(q <= kFew ? box_minimum_step<kFew>(theta, lambda)
                  : box_minimum_step<Eigen::Dynamic>(theta, lambda)))
    return false;
  std::fill(delta_full.begin(), delta_full.end(), 0.0);
  for (std::size_t k = 0; k < q; ++k)
    delta_full[data.free[k]] = delta[k];
  return true;
}

// Solves by Cholesky factorisation; held parameters do not move.
bool GaussNewtonEquations::solve_free(double lambda) {
  const std::size_t q = data.free.size();
  for (std::size_t k = 0; k < q; ++k) {
    delta[k] = held_[k] ? 0.0 : gradient[k];
    for (std::size_t l = 0; l < k; ++l)
      factors_[k * q + l] = held_[k] || held_[l] ? 0.0 : gram[k * q + l];
    factors_[k * q + k] = held_[k] ? 1.0 : (1.0 + lambda) * gram[k * q + k];
  }
  for (std::size_t k = 0; k < q; ++k) {
    const double diagonal = factors_[k * q + k];
    double sum = diagonal;
    for (std::size_t m = 0; m < k; ++m)
      sum -= factors_[k * q + m] * factors_[k * q + m];
    if (!(sum > kLeastPivot * diagonal)) return false;
    const double inverse = 1.0 / std::sqrt(sum);
    factors_[k * q + k] = inverse;  // of the diagonal of the factor
    for (std::size_t r = k + 1; r < q; ++r) {
      double value = factors_[r * q + k];
      for (std::size_t m = 0; m < k; ++m)
        value -= factors_[r * q + m] * factors_[k * q + m];
      factors_[r * q + k] = value * inverse;
    }
  }
  for (std::size_t k = 0; k < q; ++k) {
    for (std::size_t m = 0; m < k; ++m)
      delta[k] -= factors_[k * q + m] * delta[m];
    delta[k] *= factors_[k * q + k];
  }
  for (std::size_t k = q; k-- > 0;) {
    for (std::size_t r = k + 1; r < q; ++r)
      delta[k] -= factors_[r * q + k] * delta[r];
    delta[k] *= factors_[k * q + k];
  }
  return true;
}

// True if `delta` is already the minimum inside the bounds: no data.free parameter leaves them, and
// every held one would.
bool GaussNewtonEquations::stays_inside(const std::vector<double>& theta, double lambda) const {
  const std::size_t q = data.free.size();
  for (std::size_t k = 0; k < q; ++k) {
    if (pinned[k]) continue;
    const ModelParameter& p = data.model.parameters()[data.free[k]];
    const double now = theta[data.free[k]];
    if (!held_[k]) {
      if (now + delta[k] < p.lower || now + delta[k] > p.upper) return false;
      continue;
    }
    double slope = gradient[k] - lambda * gram[k * q + k] * delta[k];
    for (std::size_t l = 0; l < q; ++l)
      slope -= gram[std::max(k, l) * q + std::min(k, l)] * delta[l];
    if (now <= p.lower ? slope > 0.0 : slope < 0.0) return false;
  }
  return true;
}

template <int Most>
bool GaussNewtonEquations::box_minimum_step(const std::vector<double>& theta, double lambda) {
  const auto q = static_cast<Eigen::Index>(data.free.size());
  BoxVector<Most> right(q), lower(q), upper(q), x(q);
  BoxMatrix<Most> a(q, q);
  for (Eigen::Index k = 0; k < q; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const ModelParameter& p = data.model.parameters()[data.free[at]];
    right[k] = gradient[at];
    lower[k] = pinned[at] ? 0.0 : p.lower - theta[data.free[at]];
    upper[k] = pinned[at] ? 0.0 : p.upper - theta[data.free[at]];
    for (Eigen::Index l = 0; l <= k; ++l)
      a(k, l) = a(l, k) = gram[at * data.free.size() + static_cast<std::size_t>(l)];
  }
  if (!damped_box_step<Most>(a, right, lower, upper, lambda, kLeastPivot, x)) return false;
  std::copy(x.begin(), x.end(), delta.begin());
  return true;
}

// A parameter that leaves a bound at zero has the relative step 1, not a huge one.
double GaussNewtonEquations::relative_step(const std::vector<double>& theta) const {
  double worst = 0.0;
  for (std::size_t k = 0; k < data.free.size(); ++k) {
    const double now = theta[data.free[k]];
    const double size = std::max({std::fabs(now), std::fabs(now + delta[k]), 1e-12});
    worst = std::max(worst, std::fabs(delta[k]) / size);
  }
  return worst;
}

double GaussNewtonEquations::share_within(const std::vector<double>& theta,
                                          const std::vector<double>& start, double most) const {
  double share = 1.0;
  for (std::size_t k = 0; k < delta_full.size(); ++k) {
    const double size = most * std::max(std::fabs(theta[k]), std::fabs(start[k]));
    if (std::fabs(delta_full[k]) * share > size && size > 0.0)
      share = size / std::fabs(delta_full[k]);
  }
  return share;
}

bool GaussNewtonEquations::cap_step(const std::vector<double>& theta,
                                    const std::vector<double>& start) {
  const double share = share_within(theta, start, 1.0);
  for (double& d : delta_full)
    d *= share;
  for (double& d : delta)
    d *= share;
  return share < 1.0;
}

double GaussNewtonEquations::objective(const std::vector<double>& theta) const {
  if (!data.priors) return sum_of_squares;
  const double prior = data.prior_sum(theta);
  if (data.covariances || data.options.noise > 0.0)
    return sum_of_squares + data.noise_variance(sum_of_squares) * prior;
  const double degrees =
      static_cast<double>(data.observations) - static_cast<double>(data.free.size());
  return degrees * std::log(std::max(sum_of_squares + data.total_scatter, 1e-300)) + prior;
}

}  // namespace shaker::estimator
