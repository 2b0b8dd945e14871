// The loop of Levenberg and Marquardt, after Ceres' trust_region_minimizer: named questions to a
// problem, and the damping as a strategy apart.
//
// A Problem answers:
//   bool compute_step(double lambda)    the damped step from here; false: there is none, because the
//                                       matrix is singular
//   bool converged_before_step()        whether that step is the last one, and made
//   bool step_is_successful()           makes the step; false: it was taken back
//   bool converged_after_success()      whether the minimum is reached, after a step that was made
//   bool converged_after_failure()      the same after one that was taken back
// A Damping has `lambda`, and:
//   bool raise_after_invalid_step()     false: more damping would not help
//   bool raise_after_failure()          the same
//   void lower_after_success()
#pragma once

namespace shaker::estimator {

enum class LoopEnd { converged, invalid_step, refused_step, too_many_iterations };

// Full steps; the first that cannot be made is the last.
struct NoDamping {
  double lambda = 0.0;
  bool raise_after_invalid_step() const { return false; }
  bool raise_after_failure() const { return false; }
  void lower_after_success() const {}
};

template <class Problem, class Damping>
LoopEnd minimise_damped(Problem& problem, Damping& damping, int max_iterations) {
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (!problem.compute_step(damping.lambda)) {
      if (!damping.raise_after_invalid_step()) return LoopEnd::invalid_step;
    } else if (problem.converged_before_step()) {
      return LoopEnd::converged;
    } else if (problem.step_is_successful()) {
      if (problem.converged_after_success()) return LoopEnd::converged;
      damping.lower_after_success();
    } else {
      if (problem.converged_after_failure()) return LoopEnd::converged;
      if (!damping.raise_after_failure()) return LoopEnd::refused_step;
    }
  }
  return LoopEnd::too_many_iterations;
}

}  // namespace shaker::estimator
