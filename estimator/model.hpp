// A model: a sum of effects on the generalised coordinates, written as a residual
//
//     g(u, u', u''; x, theta) = M u'' + sum over effects of w f(c.u, c.u', c.u''; theta) - e x(t) =
//     0
//
// with u the s coordinates (s = 1 for the oleo: its stroke), M the mass matrix over the reference
// mass, c the combination of coordinates that an effect sees, w the equations in which its force
// stands, e the way in which the table's acceleration x enters. Equations (5.1), (6.2), (6.3).
//
// Immutable after construction: one model serves all threads, each with its own PeriodicSystem.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/model.hpp"
#include "estimator/effects/effect.hpp"

namespace shaker::estimator {

struct ModelParameter {
  std::string name;  // unique in the model
  std::string effect;
  std::string unit;  // in the model's own length unit
  double start = 0.0, lower = 0.0, upper = 0.0;
  bool fixed = false;
  std::optional<double> prior_mean, prior_standard_deviation;  // both or none: normal prior (3.8)
};

// Values at n points, an array per coordinate; see Points for alignment.
struct ModelPoints {
  int n = 0;
  const double* const* u = nullptr;
  const double* const* v = nullptr;
  const double* const* a = nullptr;
  const double* x = nullptr;  // excitation
};

// Residual and partial derivatives at n points, all overwritten. g has s arrays; the Jacobians s*s,
// row (equation) by row; g_theta s*p, row by row. `scratch` has 4 + p_max arrays (only for s > 1).
struct ModelForces {
  double* const* g = nullptr;
  double* const* g_u = nullptr;
  double* const* g_v = nullptr;
  double* const* g_a = nullptr;
  double* const* g_theta = nullptr;
  double* const* scratch = nullptr;
};

class Model {
 public:
  // Throws std::invalid_argument with the model file's name, the place and what is allowed, for an
  // unknown effect, parameter or constant, contradictory bounds, or a start outside them.
  explicit Model(const config::ModelSpec& spec);

  const std::string& name() const { return name_; }
  const std::string& length_unit() const { return length_unit_; }
  int coordinates() const { return coordinates_; }
  int observed() const { return observed_; }  // the coordinate that the displacement sensor sees
  // The way in which the table's acceleration enters an equation.
  double excitation(int equation) const { return excitation_[static_cast<std::size_t>(equation)]; }
  int parameter_count() const { return static_cast<int>(parameters_.size()); }
  const std::vector<ModelParameter>& parameters() const { return parameters_; }
  std::vector<double> start() const;

  // False when a point is inadmissible. Neither allocates nor throws.
  bool evaluate(const ModelPoints& at, const double* theta, const ModelForces& out) const;

  // Jump of d2g/dv2 at v = 0 for a model of one coordinate (Effect::velocity_kink); 0 for more.
  double velocity_kink(const double* theta) const;

 private:
  struct Term {
    const Effect* effect = nullptr;
    int first_parameter = 0;
    std::vector<double> constants;
    std::vector<double> sees, acts;  // s each
  };
  void add_effect(const config::EffectSpec& spec, std::size_t index,
                  const config::ModelSpec& model);
  bool evaluate_one(const ModelPoints& at, const double* theta, const ModelForces& out) const;
  bool evaluate_many(const ModelPoints& at, const double* theta, const ModelForces& out) const;

  std::string name_, length_unit_;
  int coordinates_ = 1;
  int observed_ = 0;
  std::vector<Term> terms_;
  std::vector<ModelParameter> parameters_;
  std::vector<double> mass_;        // s*s
  std::vector<double> excitation_;  // s
};

}  // namespace shaker::estimator
