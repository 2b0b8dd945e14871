// States and sensitivities of a batch of arcs, with all arrays of a step.
#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/solve/time/integration.hpp"
#include "estimator/solve/time/internal/lane_steps.hpp"
#include "estimator/solve/time/state_equations.hpp"

namespace shaker::estimator {

// Of each state: the state that is its rate, or -1. Coordinates with a mass have one.
std::vector<int> followed_states(const StateEquations& equations);

struct LaneBlock {
  int n = 0;
  std::size_t stride = 0, components = 0;
  AlignedVector numbers;
  LaneStep step;
  std::vector<double*> y, base;  // the states in `step`
  std::vector<double*> rate, first_rate;
  std::array<std::vector<double*>, kClassicStages> h_s, h_theta;  // at each stage
  std::array<std::vector<const double*>, kClassicStages>
      columns;  // of h_theta: the free parameters
  double *h = nullptr, *x_middle = nullptr, *x_end = nullptr;
  double* measured = nullptr;
  double* slopes = nullptr;  // h_s and h_theta of stage 0
  StateEquations::Workspace work;

  // For `lanes` arcs of m states over k columns (0: states alone). `follows` must outlive it.
  void shape(int lanes, std::size_t m, std::size_t k, const std::vector<int>& follows,
             const std::vector<int>& free, std::size_t p);
  // Sets y to the arcs' starts, one arc a lane, and the derivatives to those of a start.
  void begin(std::span<const Arc> arcs);
  // Writes y into the arcs' results at sample `node`.
  void write(std::span<Arc> arcs, std::size_t node) const;
  double* component(double* of, std::size_t c) const { return of + c * stride; }
  void turn() {
    std::swap(step.y, step.base);
    std::swap(y, base);
  }
};

}  // namespace shaker::estimator
