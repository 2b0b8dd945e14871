// Options and result of a method: plain data, the same for all methods.
#pragma once

#include <string>
#include <string_view>

#include <Eigen/Core>

namespace shaker::estimator::optimisers {

enum class Status {
  converged,     // the remaining step, or the part of e that theta can still explain, is tiny
  stalled,       // no smaller phi was found along the direction; perhaps not a minimum
  too_many,      // the limit of iterations or evaluations was reached
  inadmissible,  // the start is inadmissible
};

constexpr std::string_view name(Status status) {
  constexpr std::string_view names[] = {"converged", "stalled", "too many iterations",
                                        "inadmissible start"};
  return names[static_cast<int>(status)];
}

struct Options {
  int max_iterations = 200;
  int max_evaluations = 20000;
  // Converged when the remaining full step is below this share of every parameter, ...
  double step_tolerance = 1e-9;
  // ... or when |J J^+ e| is below this share of |e|. This is the part of the residuals that theta
  // can still explain (relative offset of Bates and Watts), independent of the parameters' scales.
  double offset_tolerance = 1e-9;
  // Under-relaxation: share of the step in the first `relaxed_iterations` iterations.
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
  int jacobians = 0;    // evaluations with J
  int curvatures = 0;   // exact Q
  int refused = 0;      // inadmissible steps
  bool at_bound = false;
};

}  // namespace shaker::estimator::optimisers
