// The paper's time-integration program with its error.
//
// Classical Runge-Kutta with h = 0.01 s, sensitivities (5.10) integrated with the state, full
// Gauss-Newton steps (4.7) for (u0, u0', theta1..theta4) of (6.3). In the paper's figures 9 and 10
// the derivative of the damping force, (A.3), lacks its factor 2: only `damping_slope` 1 reproduces
// them. This is why the paper counts 11 iterations where 5 are needed. TransientEstimator uses the
// correct derivative; this program shows the difference.
#pragma once

#include <span>
#include <vector>

namespace shaker::estimator::paper {

struct SlippedProgram {
  double gravity = 32.1859;    // ft/s^2: best agreement with the print; the paper gives no value
  double damping_slope = 1.0;  // times theta1 |u'|; 2 is correct

  // Returns u (ft) at 0, 0.01, .. s; p = (u0, u0', theta1, .. theta4).
  std::vector<double> response(const std::vector<double>& p, int samples) const;
  // Returns the iterates after the start.
  std::vector<std::vector<double>> iterate(std::span<const double> data, std::vector<double> start,
                                           int iterations) const;
};

}  // namespace shaker::estimator::paper
