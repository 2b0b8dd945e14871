#include "estimator/math/box_minimum.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;

constexpr Index kMostRounds = 20;   // per variable; many times more than ever needed
constexpr double kNoSlope = 1e-12;  // relative to the gradient at 0

enum class Held { no, low, high };

template <int Most>
struct Search {
  const BoxMatrix<Most>& a;
  const BoxVector<Most>& b;
  const BoxVector<Most>& lower;
  const BoxVector<Most>& upper;
  Eigen::Matrix<Held, Eigen::Dynamic, 1, 0, Most, 1> held;
  Eigen::Matrix<Index, Eigen::Dynamic, 1, 0, Most, 1> free;
  BoxVector<Most> x, target, slope, part_step;
  BoxMatrix<Most> part;

  // Starts at 0 and holds the variables that are on a bound and pushed outwards.
  void begin() {
    const Index n = b.size();
    x = target = BoxVector<Most>::Zero(n);
    held.resize(n);
    for (Index k = 0; k < n; ++k)
      held[k] = lower[k] >= 0.0 && b[k] < 0.0   ? Held::low
                : upper[k] <= 0.0 && b[k] > 0.0 ? Held::high
                                                : Held::no;
  }

  // Finds `target`, the minimum over the free variables; the others do not move.
  bool find_target(double least_pivot) {
    Index count = 0;
    free.resize(b.size());
    for (Index k = 0; k < b.size(); ++k) {
      if (held[k] == Held::no) free[count++] = k;
    }
    free.conservativeResize(count);
    target = x;
    if (count == 0) return true;
    slope = b - a * x;
    part.resize(count, count);
    part_step.resize(count);
    for (Index i = 0; i < count; ++i) {
      part_step[i] = slope[free[i]];
      for (Index j = 0; j < count; ++j)
        part(i, j) = a(free[i], free[j]);
    }
    const Eigen::LDLT<BoxMatrix<Most>> factors(part);
    part_step = factors.solve(part_step).eval();
    for (Index i = 0; i < count; ++i)
      target[free[i]] += part_step[i];
    return factors.vectorD().minCoeff() > least_pivot * part.diagonal().maxCoeff();
  }

  // Moves towards `target` up to the first bound, which then holds its variable. Returns false
  // if it met no bound.
  bool meets_bound() {
    double share = 1.0;
    Index first = -1;
    for (Index i = 0; i < free.size(); ++i) {
      const Index k = free[i];
      if (target[k] >= lower[k] && target[k] <= upper[k]) continue;
      const double bound = target[k] < lower[k] ? lower[k] : upper[k];
      const double own = (bound - x[k]) / (target[k] - x[k]);
      if (own >= share) continue;
      share = own;
      first = k;
    }
    x += share * (target - x);
    if (first < 0) return false;
    const bool low = target[first] < lower[first];
    x[first] = low ? lower[first] : upper[first];
    held[first] = low ? Held::low : Held::high;
    return true;
  }

  // Frees the held variable with the steepest gradient inwards. Returns false if there is none.
  bool release() {
    slope = b - a * x;
    double steepest = kNoSlope * b.cwiseAbs().maxCoeff();
    Index inwards = -1;
    for (Index k = 0; k < b.size(); ++k) {
      const double inward = held[k] == Held::low    ? slope[k]
                            : held[k] == Held::high ? -slope[k]
                                                    : 0.0;
      if (inward <= steepest || !(lower[k] < upper[k])) continue;
      steepest = inward;
      inwards = k;
    }
    if (inwards < 0) return false;
    held[inwards] = Held::no;
    return true;
  }
};

}  // namespace

template <int Most>
bool box_minimum(const BoxMatrix<Most>& a, const BoxVector<Most>& b, const BoxVector<Most>& lower,
                 const BoxVector<Most>& upper, double least_pivot, BoxVector<Most>& x) {
  Search<Most> search{a, b, lower, upper, {}, {}, {}, {}, {}, {}, {}};
  search.begin();
  bool definite = true;
  for (Index round = 0; round < kMostRounds * (b.size() + 1); ++round) {
    definite = search.find_target(least_pivot) && definite;
    if (search.meets_bound()) continue;
    if (!search.release()) break;
  }
  x = search.x;
  return definite;
}

template bool box_minimum<8>(const BoxMatrix<8>&, const BoxVector<8>&, const BoxVector<8>&,
                             const BoxVector<8>&, double, BoxVector<8>&);
template bool box_minimum<Eigen::Dynamic>(const Eigen::MatrixXd&, const Eigen::VectorXd&,
                                          const Eigen::VectorXd&, const Eigen::VectorXd&, double,
                                          Eigen::VectorXd&);

template <int Most>
bool damped_box_step(const BoxMatrix<Most>& gram, const BoxVector<Most>& gradient,
                     const BoxVector<Most>& lower, const BoxVector<Most>& upper, double damping,
                     double least_pivot, BoxVector<Most>& x) {
  BoxVector<Most> scale = gram.diagonal().cwiseSqrt();
  for (double& s : scale)
    s = s > 0.0 ? s : 1.0;
  BoxMatrix<Most> a = scale.cwiseInverse().asDiagonal() * gram * scale.cwiseInverse().asDiagonal();
  a.diagonal().array() += damping;
  const BoxVector<Most> low = scale.cwiseProduct(lower), high = scale.cwiseProduct(upper);
  const bool definite =
      box_minimum<Most>(a, gradient.cwiseQuotient(scale), low, high, least_pivot, x);
  for (Index k = 0; k < x.size(); ++k)
    x[k] = x[k] <= low[k] ? lower[k] : x[k] >= high[k] ? upper[k] : x[k] / scale[k];
  return definite;
}

template bool damped_box_step<8>(const BoxMatrix<8>&, const BoxVector<8>&, const BoxVector<8>&,
                                 const BoxVector<8>&, double, double, BoxVector<8>&);
template bool damped_box_step<Eigen::Dynamic>(const Eigen::MatrixXd&, const Eigen::VectorXd&,
                                              const Eigen::VectorXd&, const Eigen::VectorXd&,
                                              double, double, Eigen::VectorXd&);

Eigen::VectorXd damped_box_step(const Eigen::MatrixXd& gram, const Eigen::VectorXd& gradient,
                                const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                                double damping) {
  Eigen::VectorXd x;
  damped_box_step<Eigen::Dynamic>(gram, gradient, lower, upper, damping, 0.0, x);
  return x;
}

}  // namespace shaker::estimator
