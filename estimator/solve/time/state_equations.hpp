// A model as state equations (5.2), s' = h(s, x, t, theta), with the coefficients h_s and h_theta
// of its sensitivity equations (5.10). All time integrators use them.
//
// The model is implicit, g(u, u', u'', x; theta) = 0. A coordinate with a mass has two states:
// itself and its velocity. A coordinate without mass (an internal state of an effect: friction with
// memory, gas temperature) has one state, and its equation gives its rate. The accelerations and
// these rates are the unknowns q of g = 0. Newton's method solves it, in one step where g is linear
// in q. Then h_s = -g_q^-1 g_s and h_theta = -g_q^-1 g_theta.
//
// Order of the states: all coordinates, then the velocities of those with a mass.
//
// rates() works on a batch of n lanes (many segments of a record). Arrays are those of ModelPoints:
// 64-byte aligned, readable up to the next multiple of 8.
#pragma once

#include <string>
#include <vector>

#include "estimator/model/model.hpp"
#include "estimator/model/model_arrays.hpp"
#include "estimator/solve/time/internal/lane_inverse.hpp"

namespace shaker::estimator {

class StateEquations {
 public:
  // `force`: constant forces over the reference mass, m/s^2, one for each equation (the wing's lift
  // in a drop); empty: none. `model` must outlive it. Throws std::invalid_argument when the number
  // of forces is wrong, or when the model has an effect that needs a periodic excitation.
  explicit StateEquations(const Model& model, std::vector<double> force = {});

  const Model& model() const { return model_; }
  int coordinates() const { return coordinates_; }
  int states() const { return states_; }
  int parameters() const { return model_.parameter_count(); }
  // Index of the state that is the coordinate's velocity; -1 for one without mass.
  int velocity_of(int coordinate) const { return velocity_[static_cast<std::size_t>(coordinate)]; }
  // Names for messages, such as "stroke" and "stroke'".
  const std::vector<std::string>& names() const { return names_; }

  // Each thread needs its own. It allocates when n is larger than before.
  class Workspace {
   private:
    friend class StateEquations;
    int lanes = 0;
    ModelArrays at;
    LaneInverse inverse;   // of g_q
    AlignedVector change;  // of an unknown, in one Newton step
    std::vector<const double*> v, from;
    std::vector<double*> to;
  };

  // Computes `rate` (`states` arrays of n) and, unless nullptr, `h_s` (states * states arrays, row
  // by row) and `h_theta` (states * parameters arrays). Rows of coordinates with a mass are known (1
  // at the velocity); their arrays and
  // that of their rate may be null. `x`: the excitation of each lane, m/s^2.
  // Returns false when a lane is inadmissible (1 - theta3 u <= 0) or its equations are singular;
  // the output is then unspecified. Several threads may call it, each with its own workspace.
  bool rates(int n, const double* const* s, const double* x, const double* theta, Workspace& work,
             double* const* rate, double* const* h_s, double* const* h_theta) const;

 private:
  void find_kinds();
  bool derivatives_know_rates() const;
  bool evaluate(int n, const double* const* s, const double* x, const double* theta, bool slopes,
                Workspace& work) const;
  bool solve_lanes(int n, Workspace& work, double* largest, double* scale) const;
  bool invert(int n, Workspace& work) const;
  bool single_rates(int n, const double* const* s, Workspace& work, double* const* rate,
                    double* const* h_s, double* const* h_theta) const;
  void derivatives(int n, Workspace& work, double* const* h_s, double* const* h_theta) const;
  void reserve(int n, Workspace& work) const;

  const Model& model_;
  std::vector<double> force_;
  int coordinates_ = 1, states_ = 2;
  std::vector<int> velocity_;
  std::vector<std::string> names_;
  bool once_ = false;  // derivatives do not depend on q: one evaluation suffices
};

}  // namespace shaker::estimator
