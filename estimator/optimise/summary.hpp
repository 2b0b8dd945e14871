// What a method may use and what it says in the end: plain data, the same for all of them.
#pragma once

#include <string>
#include <string_view>

#include <Eigen/Core>

namespace shaker::estimator::optimise {

enum class Status {
  converged,     // the step that is left, or the part of e that theta could still explain, is tiny
  stalled,       // no smaller phi was found along the direction; not proven a minimum
  too_many,      // iterations or evaluations ran out
  inadmissible,  // the start is: there is nothing to begin with
};

constexpr std::string_view name(Status status) {
  constexpr std::string_view names[] = {"converged", "stalled", "too many iterations",
                                        "inadmissible start"};
  return names[static_cast<int>(status)];
}

struct Options {
  int max_iterations = 200;
  int max_evaluations = 20000;
  // Converged when the full step that is left is below this share of every parameter, ...
  double step_tolerance = 1e-9;
  // ... or when |J J^+ e| is below this share of |e|: what theta could still explain of the
  // residuals (the relative offset of Bates and Watts, free of the parameters' scales).
  double offset_tolerance = 1e-9;
  // Under-relaxation: this share of the step in so many first iterations.
  double relaxation = 0.25;
  int relaxed_iterations = 6;
};

struct Summary {
  std::string method;
  Status status = Status::inadmissible;
  Eigen::VectorXd theta;
  double sum_of_squares = 0.0;  // e^T e = 2 phi
  int iterations = 0;
  int evaluations = 0;  // of e
  int jacobians = 0;    // of which with J
  int curvatures = 0;   // exact Q
  int refused = 0;      // inadmissible steps
  bool at_bound = false;
};

}  // namespace shaker::estimator::optimise
