#include "estimator/paper/optimisers/internal/extended.hpp"

#include <algorithm>
#include <optional>

namespace shaker::estimator::optimisers {
namespace {

using Vector = std::vector<Extended>;

// Lower Cholesky factor of a matrix scaled to unit diagonal.
struct Factor {
  Vector lower, scale;
  std::size_t size;

  Vector solve(const Vector& right) const {
    Vector x(size);
    for (std::size_t k = 0; k < size; ++k) {
      Extended sum = right[k] * scale[k];
      for (std::size_t m = 0; m < k; ++m)
        sum -= lower[k * size + m] * x[m];
      x[k] = sum / lower[k * size + k];
    }
    for (std::size_t k = size; k-- > 0;) {
      Extended sum = x[k];
      for (std::size_t m = k + 1; m < size; ++m)
        sum -= lower[m * size + k] * x[m];
      x[k] = sum / lower[k * size + k];
    }
    for (std::size_t k = 0; k < size; ++k)
      x[k] *= scale[k];
    return x;
  }
};

std::optional<Factor> factorise(const Vector& matrix, std::size_t size) {
  Factor f{Vector(size * size), Vector(size), size};
  for (std::size_t k = 0; k < size; ++k) {
    if (!(matrix[k * size + k] > 0)) return std::nullopt;
    f.scale[k] = 1 / sqrt(matrix[k * size + k]);
  }
  for (std::size_t k = 0; k < size; ++k) {
    for (std::size_t l = 0; l <= k; ++l) {
      Extended sum = matrix[k * size + l] * f.scale[k] * f.scale[l];
      for (std::size_t m = 0; m < l; ++m)
        sum -= f.lower[k * size + m] * f.lower[l * size + m];
      if (k != l) {
        f.lower[k * size + l] = sum / f.lower[l * size + l];
        continue;
      }
      if (!(sum > 1e-28)) return std::nullopt;
      f.lower[k * size + k] = sqrt(sum);
    }
  }
  return f;
}

}  // namespace

Polished polish(const ExtendedProblem& problem, const std::vector<double>& start) {
  constexpr int kMost = 60;
  constexpr double kTolerance = 1e-20;
  const std::size_t p = start.size();
  Vector theta(start.begin(), start.end());
  ExtendedProducts at;
  Polished out;
  if (!problem.products(theta, at)) return out;
  for (; out.iterations < kMost; ++out.iterations) {
    Vector hessian(p * p);
    for (std::size_t k = 0; k < p * p; ++k)
      hessian[k] = at.gram[k] + at.q[k];
    auto factor = factorise(hessian, p);
    if (!factor) factor = factorise(at.gram, p);
    if (!factor) break;
    const Vector step = factor->solve(at.downhill);
    Extended length = 0;
    for (std::size_t k = 0; k < p; ++k)
      length = std::max<Extended>(length, abs(step[k]) / (abs(theta[k]) + 1e-300));
    ExtendedProducts next;
    Vector trial(p);
    bool better = false;
    for (Extended share = 1; share > 1e-6 && !better; share /= 2) {
      for (std::size_t k = 0; k < p; ++k)
        trial[k] = theta[k] + share * step[k];
      better = problem.products(trial, next) && (length <= 1e-12 || next.sum <= at.sum);
    }
    if (!better) break;
    theta = trial;
    at = next;
    if (length <= kTolerance) {
      out.converged = true;
      break;
    }
  }
  for (const Extended& value : theta)
    out.theta.push_back(static_cast<double>(value));
  out.sum_of_squares = static_cast<double>(at.sum);
  if (const auto factor = factorise(at.gram, p)) {
    for (std::size_t k = 0; k < p; ++k) {
      Vector unit(p, Extended(0));
      unit[k] = 1;
      for (const Extended& value : factor->solve(unit))
        out.inverse_gram.push_back(static_cast<double>(value));
    }
  } else {
    out.converged = false;
  }
  return out;
}

}  // namespace shaker::estimator::optimisers
