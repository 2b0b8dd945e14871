// Bifurcations between two points of a curve: sign changes reveal them, false position locates
// them.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "estimator/solve/periodic/continuation.hpp"

namespace shaker::estimator {
namespace {

constexpr double kLocated = 1e-10;  // tolerance, share of the distance between two points

// det(M - at), real because multipliers come in conjugate pairs.
double determinant(const Floquet& f, double at) {
  std::complex<double> product = 1.0;
  for (const auto& m : f.multipliers)
    product *= m - at;
  return product.real();
}

int outside(const Floquet& f) {
  return static_cast<int>(std::count_if(f.multipliers.begin(), f.multipliers.end(),
                                        [](const auto& m) { return std::abs(m) > 1.0; }));
}

using Test = std::function<double(const BranchPoint&)>;

// False position (Illinois variant) over the plane's position between two points, from 0 to 1.
// `point_at` computes the point at a position, or nothing if that fails.
template <class PointAt>
std::optional<BranchPoint> locate(double test_a, double test_b, const Test& test,
                                  const PointAt& point_at) {
  double a = 0.0, b = 1.0;
  std::optional<BranchPoint> best;
  double best_test = 1e300;
  int side = 0;  // which end was replaced last: -1 lower, 1 upper
  for (int round = 0; round < 60 && b - a > kLocated; ++round) {
    double s = (a * test_b - b * test_a) / (test_b - test_a);
    if (!(s > a && s < b)) s = 0.5 * (a + b);
    std::optional<BranchPoint> point = point_at(s);
    if (!point) return best;
    const double value = test(*point);
    if (std::fabs(value) < best_test) {
      best_test = std::fabs(value);
      best = std::move(point);
    }
    if (value == 0.0) break;
    if ((value < 0.0) == (test_a < 0.0)) {
      if (side == -1) test_b *= 0.5;
      side = -1;
      a = s;
      test_a = value;
    } else {
      if (side == 1) test_a *= 0.5;
      side = 1;
      b = s;
      test_b = value;
    }
  }
  return best;
}

}  // namespace

std::string_view name(Bifurcation kind) {
  constexpr std::string_view names[] = {"fold", "branch point", "period doubling", "torus"};
  return names[static_cast<int>(kind)];
}

std::optional<BranchPoint> Continuation::between(SolutionArc& arc, const BranchPoint& a,
                                                 const BranchPoint& b, const ArcPoint& tangent,
                                                 double share, bool forward) {
  ArcPoint guess = a.at, on, direction;
  for (std::size_t k = 0; k < guess.z.size(); ++k)
    guess.z[k] += share * (b.at.z[k] - a.at.z[k]);
  guess.value += share * (b.at.value - a.at.value);
  if (arc.correct(guess, tangent, on, 12) == 0 || !arc.tangent(on, tangent, direction))
    return std::nullopt;
  BranchPoint point = describe(arc, on, forward ? direction.value : -direction.value);
  point.arclength = a.arclength + share * (b.arclength - a.arclength);
  return point;
}

void Continuation::look_between(SolutionArc& arc, const BranchPoint& a, const BranchPoint& b,
                                const ArcPoint& tangent, Branch& branch) {
  const bool forward = branch.to > branch.from;
  const auto point_at = [&](double share) { return between(arc, a, b, tangent, share, forward); };
  const auto seek = [&](Bifurcation kind, const Test& test) {
    const double at_a = test(a), at_b = test(b);
    if ((at_a < 0.0) == (at_b < 0.0)) return false;
    if (auto found = locate(at_a, at_b, test, point_at))
      branch.special.push_back({kind, std::move(*found), branch.points.size() - 1});
    return true;
  };
  bool any = seek(Bifurcation::fold, [](const BranchPoint& p) { return p.turning; });
  if (a.floquet.multipliers.empty() || b.floquet.multipliers.empty()) return;
  any = any || seek(Bifurcation::branch_point,
                    [](const BranchPoint& p) { return determinant(p.floquet, 1.0); });
  any = seek(Bifurcation::period_doubling,
             [](const BranchPoint& p) { return determinant(p.floquet, -1.0); }) ||
        any;
  if (!any && std::abs(outside(a.floquet) - outside(b.floquet)) == 2)
    seek(Bifurcation::torus, [](const BranchPoint& p) { return p.floquet.largest() - 1.0; });
}

std::vector<BranchPoint> Continuation::solutions_at(const Branch& branch, double value) {
  std::vector<BranchPoint> found;
  if (branch.points.empty()) return found;
  SolutionArc arc = make_arc(branch);
  const bool forward = branch.to > branch.from;
  const double reached = 1e-12 * std::max(std::fabs(value), arc.range());
  // The sequence includes the folds, so that the solutions on both sides of one are found.
  std::vector<const BranchPoint*> sequence;
  std::size_t next_special = 0;
  for (std::size_t i = 0; i < branch.points.size(); ++i) {
    sequence.push_back(&branch.points[i]);
    for (; next_special < branch.special.size() && branch.special[next_special].after == i;
         ++next_special) {
      if (branch.special[next_special].kind == Bifurcation::fold)
        sequence.push_back(&branch.special[next_special].point);
    }
  }
  const Test test = [&](const BranchPoint& p) { return p.at.value - value; };
  for (std::size_t i = 0; i + 1 < sequence.size(); ++i) {
    const BranchPoint &a = *sequence[i], &b = *sequence[i + 1];
    if (std::fabs(test(a)) <= reached) {
      found.push_back(a);
      continue;
    }
    if ((test(a) < 0.0) == (test(b) < 0.0) || std::fabs(test(b)) <= reached) continue;
    ArcPoint tangent = difference(b.at, a.at);
    arc.set_scale(a.at, tangent);
    if (auto point = locate(test(a), test(b), test, [&](double share) {
          return between(arc, a, b, tangent, share, forward);
        })) {
      ArcPoint exact;
      if (arc.solve_at(value, point->at.z, exact)) {
        const ArcPoint moved = difference(exact, point->at);
        if (arc.dot(moved, moved) < 1e-4) {
          const double arclength = point->arclength;
          *point = describe(arc, exact, point->turning);
          point->arclength = arclength;
        }
      }
      found.push_back(std::move(*point));
    }
  }
  if (std::fabs(test(*sequence.back())) <= reached) found.push_back(*sequence.back());
  return found;
}

}  // namespace shaker::estimator
