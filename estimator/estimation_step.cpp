// Normal equations and the step inside the box.
#include <algorithm>
#include <cmath>

#include "estimator/estimation_impl.hpp"

namespace shaker::estimator {

void Estimator::Impl::accumulate(std::vector<PeriodicSystem>& level, bool with_newton) {
  const std::size_t size = 1 + fit.theta.size();
  std::fill(products.begin(), products.end(), 0.0);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const RunState& run = runs[r];
    const int every = &level == &coarse ? 1 : run.every;
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

// Cholesky on the parameters that are not held; a parameter that would leave its box is put on the
// bound and held, and the rest solved again.
bool Estimator::Impl::box_step(double lambda) {
  const std::size_t q = free.size();
  const auto& parameters = model.parameters();
  for (std::size_t k = 0; k < q; ++k) {
    const ModelParameter& p = parameters[free[k]];
    const double theta = fit.theta[free[k]];
    held[k] = pinned[k] || (theta <= p.lower && gradient[k] < 0.0) ||
              (theta >= p.upper && gradient[k] > 0.0);
    delta[k] = 0.0;
  }
  for (std::size_t round = 0; round <= q; ++round) {
    for (std::size_t k = 0; k < q; ++k) {
      scratch_vector[k] = gradient[k];
      for (std::size_t l = 0; l <= k; ++l) {
        double value = gram[k * q + l];
        if (k == l) value *= 1.0 + lambda;
        if (held[k] || held[l]) {
          if (held[l] && !held[k]) scratch_vector[k] -= value * delta[l];
          if (held[k] && !held[l]) scratch_vector[l] -= value * delta[k];
          value = k == l ? 1.0 : 0.0;
        }
        factors[k * q + l] = value;
      }
    }
    for (std::size_t k = 0; k < q; ++k) {
      if (held[k]) scratch_vector[k] = delta[k];
    }
    // Cholesky, then forward and back substitution, in place.
    for (std::size_t k = 0; k < q; ++k) {
      const double diagonal = factors[k * q + k];
      double sum = diagonal;
      for (std::size_t m = 0; m < k; ++m)
        sum -= factors[k * q + m] * factors[k * q + m];
      if (!(sum > 1e-13 * diagonal)) return false;
      const double inverse = 1.0 / std::sqrt(sum);
      factors[k * q + k] = inverse;  // of the factor's diagonal
      for (std::size_t r = k + 1; r < q; ++r) {
        double value = factors[r * q + k];
        for (std::size_t m = 0; m < k; ++m)
          value -= factors[r * q + m] * factors[k * q + m];
        factors[r * q + k] = value * inverse;
      }
    }
    for (std::size_t k = 0; k < q; ++k) {
      for (std::size_t m = 0; m < k; ++m)
        scratch_vector[k] -= factors[k * q + m] * scratch_vector[m];
      scratch_vector[k] *= factors[k * q + k];
    }
    for (std::size_t k = q; k-- > 0;) {
      for (std::size_t r = k + 1; r < q; ++r)
        scratch_vector[k] -= factors[r * q + k] * scratch_vector[r];
      scratch_vector[k] *= factors[k * q + k];
    }
    bool inside = true;
    for (std::size_t k = 0; k < q; ++k) {
      if (held[k]) continue;
      const ModelParameter& p = parameters[free[k]];
      const double target = fit.theta[free[k]] + scratch_vector[k];
      delta[k] = std::clamp(target, p.lower, p.upper) - fit.theta[free[k]];
      if (target < p.lower || target > p.upper) {
        held[k] = 1;
        inside = false;
      }
    }
    if (inside) break;
  }
  std::fill(delta_full.begin(), delta_full.end(), 0.0);
  for (std::size_t k = 0; k < q; ++k)
    delta_full[free[k]] = delta[k];
  return true;
}

double Estimator::Impl::relative_step() const {
  double worst = 0.0;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const double theta = std::fabs(fit.theta[free[k]]);
    worst = std::max(worst, std::fabs(delta[k]) / std::max(theta, 1e-12));
  }
  return worst;
}

// Far from the optimum the linearisation sends badly determined parameters off by orders of
// magnitude, down valleys that take long to come back from: no step more than doubles a parameter.
bool Estimator::Impl::cap_step(const std::vector<double>& start) {
  double share = 1.0;
  for (std::size_t k = 0; k < delta_full.size(); ++k) {
    const double most = std::max(std::fabs(fit.theta[k]), std::fabs(start[k]));
    if (std::fabs(delta_full[k]) * share > most && most > 0.0)
      share = most / std::fabs(delta_full[k]);
  }
  for (double& d : delta_full)
    d *= share;
  for (double& d : delta)
    d *= share;
  return share < 1.0;
}

}  // namespace shaker::estimator
