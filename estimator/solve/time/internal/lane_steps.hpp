// The inner loops of Runge-Kutta steps with sensitivities: eight arcs in the lanes of a batch.
#pragma once

#include <cstdint>

namespace shaker::estimator {

inline constexpr int kMostLaneStates = 32;

inline constexpr int kClassicStages = 4;

// Component by component, `stride` doubles each, a lane for each arc. Components: the states, then
// their derivatives, state by state, over `columns` variables (the initial states, then the free
// parameters). All arrays begin on 64-byte boundaries; `stride` is a multiple of 8.
struct LaneStep {
  int stride = 0, states = 0, columns = 0;
  double *y = nullptr, *base = nullptr;  // all components
  double* sum = nullptr;                 // of the states
  const double* h = nullptr;             // step of each lane, s
  // Of each state: the state that is its rate, which comes later, or -1. Of the former, `rate`, `h_s`
  // and `h_theta` are not read.
  const int* follows = nullptr;
  const double* const* rate = nullptr;                // of the states
  const double* const* h_s[kClassicStages] = {};      // at each stage: states x states
  const double* const* h_theta[kClassicStages] = {};  // states x free parameters
  double* room = nullptr;                             // 72 states^2 doubles
};

// The stages 0 to 3 of the classical method, of the states alone. Takes the rates at `y` (at `base`
// in stage 0) and writes the argument of the next stage to y; after stage 3 that is the new state.
void advance(const LaneStep& step, int stage);

// Their derivatives from base to y, when the four stages have been made.
void advance_derivatives(const LaneStep& step);

// Writes what is compared to `rows`: the derivatives of state `seen`, then that state; a share of the
// step before y, by the cubic through both ends where `speed` is the rate of that state.
void see_between(const LaneStep& step, int seen, int speed, double share, double* rows);
// The same at y: where they are.
struct SeenRows {
  const double *derivatives, *state;
};
SeenRows seen_rows(const LaneStep& step, int seen);

// Adds to `products` the products of each lane's row: the derivatives, then `measured` less the
// state; upper half, row by row, `stride` doubles each. Lanes count where `from` <= `node` < `to`,
// and the step is not 0 where that is asked.
struct LaneData {
  const double *measured, *from, *to;
  double node;
  bool moving;
};
void add_products(const LaneStep& step, const SeenRows& rows, const LaneData& data,
                  double* products);

// Bit l: lane l of `a` and of `b` have different signs. At most 64 lanes.
std::uint64_t sign_changes(const double* a, const double* b, int stride);

// h = (after - before) share where `end` <= `last`, else 0.
void lane_steps(const double* before, const double* after, const double* last, double end,
                double share, int stride, double* h);

}  // namespace shaker::estimator
