#include "estimator/math/damped_minimum.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace shaker::estimator {
namespace {

// The minimum of (x^2 - 2)^2 by Gauss-Newton on the residual x^2 - 2, from x = `x`.
struct RootOfTwo {
  double x;
  bool singular = false, may_move = true;
  double step = 0.0;
  int steps = 0, taken_back = 0;

  double residual() const { return x * x - 2.0; }
  bool compute_step(double lambda) {
    ++steps;
    const double slope = 2.0 * x;
    step = -slope * residual() / (slope * slope * (1.0 + lambda));
    return !singular || lambda > 1.0;
  }
  bool converged_before_step() const { return std::fabs(step) < 1e-14; }
  bool step_is_successful() {
    const double here = x, before = std::fabs(residual());
    x += step;
    if (may_move && std::fabs(residual()) <= before) return true;
    x = here;
    ++taken_back;
    return false;
  }
  bool converged_after_success() const { return std::fabs(residual()) < 1e-12; }
  bool converged_after_failure() const { return std::fabs(residual()) < 1e-10; }
};

struct TenfoldDamping {
  double lambda = 1e-3;
  bool raise_after_invalid_step() { return (lambda *= 10.0) < 1e3; }
  bool raise_after_failure() { return (lambda *= 10.0) < 1e6; }
  void lower_after_success() { lambda *= 0.1; }
};

TEST(DampedMinimum, IsReachedFromFar) {
  for (const double start : {0.01, 3.0, 100.0}) {
    RootOfTwo problem{start};
    TenfoldDamping damping;
    EXPECT_EQ(minimise_damped(problem, damping, 200), LoopEnd::converged) << start;
    EXPECT_NEAR(problem.x, std::sqrt(2.0), 1e-10) << start;
  }
}

TEST(DampedMinimum, AStepThatMakesItWorseIsTakenBackAndDamped) {
  RootOfTwo problem{0.01};  // the full step leads to 100
  TenfoldDamping damping;
  EXPECT_EQ(minimise_damped(problem, damping, 200), LoopEnd::converged);
  EXPECT_GE(problem.taken_back, 3);
  RootOfTwo undamped{0.01};
  NoDamping none;
  EXPECT_EQ(minimise_damped(undamped, none, 200), LoopEnd::refused_step);
  EXPECT_EQ(undamped.x, 0.01);
}

TEST(DampedMinimum, EndsWhereMoreDampingWouldNotHelp) {
  RootOfTwo stuck{3.0};
  stuck.may_move = false;
  TenfoldDamping damping;
  EXPECT_EQ(minimise_damped(stuck, damping, 200), LoopEnd::refused_step);
  EXPECT_EQ(stuck.x, 3.0);
  EXPECT_EQ(stuck.steps, 9);  // from 1e-3 to 1e5
  RootOfTwo singular{3.0};
  singular.singular = true;
  NoDamping none;
  EXPECT_EQ(minimise_damped(singular, none, 200), LoopEnd::invalid_step);
  TenfoldDamping regular;  // raised until a step can be computed
  EXPECT_EQ(minimise_damped(singular, regular, 5), LoopEnd::too_many_iterations);
  EXPECT_EQ(singular.steps, 6);
  EXPECT_EQ(minimise_damped(singular, regular, 0), LoopEnd::too_many_iterations);
}

TEST(DampedMinimum, AtTheMinimumNoStepIsMade) {
  RootOfTwo problem{std::sqrt(2.0)};
  NoDamping none;
  EXPECT_EQ(minimise_damped(problem, none, 200), LoopEnd::converged);
  EXPECT_EQ(problem.x, std::sqrt(2.0));
  EXPECT_EQ(problem.steps, 1);
}

}  // namespace
}  // namespace shaker::estimator
