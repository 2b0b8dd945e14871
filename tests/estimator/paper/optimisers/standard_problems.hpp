// The test problems of More, Garbow and Hillstrom (1981), ACM TOMS 7, 17-41; their starts and
// minima are the independent reference. Written as y - yhat with y as the constant part.
#pragma once

#include "estimator/paper/optimisers/internal/formula_problem.hpp"

namespace shaker::estimator::optimisers::testing {

// Each observation has its own formula: x is its number (from 1) or its abscissa.
struct Rosenbrock {
  static constexpr std::size_t kParameters = 2;
  template <class B, class X>
  B operator()(const B* b, const X* x) const {
    if (x[0] == X(1)) return X(10) * (b[1] - b[0] * b[0]);
    return b[0];
  }
};
struct PowellSingular {
  static constexpr std::size_t kParameters = 4;
  template <class B, class X>
  B operator()(const B* b, const X* x) const {
    using std::sqrt;
    if (x[0] == X(1)) return b[0] + X(10) * b[1];
    if (x[0] == X(2)) return sqrt(X(5)) * (b[2] - b[3]);
    if (x[0] == X(3)) return (b[1] - X(2) * b[2]) * (b[1] - X(2) * b[2]);
    return sqrt(X(10)) * (b[0] - b[3]) * (b[0] - b[3]);
  }
};
// Large residual: phi does not vanish at the minimum, and Q matters.
struct JennrichSampson {
  static constexpr std::size_t kParameters = 2;
  template <class B, class X>
  B operator()(const B* b, const X* x) const {
    return exp(x[0] * b[0]) + exp(x[0] * b[1]);
  }
};
struct BrownDennis {
  static constexpr std::size_t kParameters = 4;
  template <class B, class X>
  B operator()(const B* b, const X* x) const {
    using std::cos;
    using std::exp;
    using std::sin;
    const X t = x[0];
    const B first = b[0] + t * b[1] - exp(t);
    const B second = b[2] + X(sin(t)) * b[3] - X(cos(t));
    return first * first + second * second;
  }
};
// Rank 1: only one combination of the parameters is determined.
struct RankOne {
  static constexpr std::size_t kParameters = 3;
  template <class B, class X>
  B operator()(const B* b, const X* x) const {
    return x[0] * (b[0] + X(2) * b[1] + X(3) * b[2]);
  }
};
// The example (6.1): only theta1 and the product theta2 theta3 are determined.
struct ProductOnly {
  static constexpr std::size_t kParameters = 3;
  template <class B, class X>
  B operator()(const B* b, const X* x) const {
    return b[0] * exp(-(b[1] * b[2] * x[0]));
  }
};
// The gas spring alone: force over stroke, with its wall at 1 - b1 u = 0.
struct GasForce {
  static constexpr std::size_t kParameters = 3;
  template <class B, class X>
  B operator()(const B* b, const X* x) const {
    return b[0] * exp(-(b[2] * log(X(1) - b[1] * x[0])));
  }
};

inline FormulaData numbered(std::vector<double> y) {
  FormulaData data;
  for (std::size_t i = 0; i < y.size(); ++i) {
    data.x.emplace_back(static_cast<double>(i + 1));
    data.y.emplace_back(y[i]);
  }
  return data;
}

}  // namespace shaker::estimator::optimisers::testing
