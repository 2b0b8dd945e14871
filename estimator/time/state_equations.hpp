// A model as state equations (5.2), s' = h(s, x, t, theta), with the coefficients h_s and
// h_theta of its sensitivity equations (5.10): what every time integration works on.
//
// The model is implicit, g(u, u', u'', x; theta) = 0. A coordinate on which a mass acts has two
// states, itself and its velocity; one without (an internal state of an effect: friction that
// remembers, gas temperature) has one, and its equation gives its own rate. The accelerations and
// those rates are the unknowns q of g = 0; Newton solves it, in one step for everything that is
// linear in q, and h_s = -g_q^-1 g_s, h_theta = -g_q^-1 g_theta follow.
//
// State order: all coordinates, then the velocities of those with a mass.
//
// All functions work on n lanes at once (many segments of a record abreast); arrays are those of
// ModelPoints: 64-byte aligned, readable up to the next multiple of 8.
#pragma once

#include <string>
#include <vector>

#include "estimator/model.hpp"
#include "estimator/model_arrays.hpp"

namespace shaker::estimator {

class StateEquations {
 public:
  // `force`: constant forces over the reference mass, one an equation (the wing's lift in a drop);
  // empty: none. `model` must outlive it. Throws std::invalid_argument when the model's equations
  // cannot be solved for its accelerations (a coordinate that no equation moves).
  explicit StateEquations(const Model& model, std::vector<double> force = {});

  const Model& model() const { return model_; }
  int coordinates() const { return coordinates_; }
  int states() const { return states_; }
  int parameters() const { return model_.parameter_count(); }
  // Index of the state that is the coordinate's velocity; -1 for one without mass.
  int velocity_of(int coordinate) const { return velocity_[static_cast<std::size_t>(coordinate)]; }
  // "stroke", "stroke'": for people.
  const std::vector<std::string>& names() const { return names_; }

  // One for each thread; grows to the largest n asked for, then allocates no more.
  class Workspace {
   private:
    friend class StateEquations;
    int lanes = 0;
    ModelArrays at;
    std::vector<double> matrix, column;  // of one lane
    std::vector<int> pivot;
  };

  // Overwrites rate (states arrays of n) and, each unless it is nullptr, h_s (states * states
  // arrays, row by row) and h_theta (states * parameters). `x`: the excitation of each lane. False
  // when a lane is inadmissible (1 - theta3 u <= 0), or its equations singular; the output is then
  // unspecified.
  bool rates(int n, const double* const* s, const double* x, const double* theta, Workspace& work,
             double* const* rate, double* const* h_s, double* const* h_theta) const;

 private:
  void find_kinds();
  bool derivatives_know_accelerations() const;
  bool evaluate(int n, const double* const* s, const double* x, const double* theta,
                Workspace& work) const;
  bool solve_lanes(int n, Workspace& work, double* largest, double* scale) const;
  bool factor(int lane, Workspace& work) const;
  void substitute(Workspace& work) const;
  void derivatives(int n, Workspace& work, double* const* h_s, double* const* h_theta) const;
  void reserve(int n, Workspace& work) const;

  const Model& model_;
  std::vector<double> force_;
  int coordinates_ = 1, states_ = 2;
  std::vector<int> velocity_;
  std::vector<std::string> names_;
  bool once_ = false;  // derivatives do not depend on q: one evaluation is enough
};

}  // namespace shaker::estimator
