// A model: a sum of effects on the generalised coordinates, written as a residual
//
//     g(u, u', u''; x, theta) = M u'' + sum over effects of w f(c.u, c.u', c.u''; theta) - e x(t) =
//     0
//
// with u the s coordinates (s = 1 for the oleo: its stroke), M the mass matrix over the reference
// mass, c the combination of coordinates that an effect sees, w the equations in which its force
// stands, e the way in which the table's acceleration x enters. Equations (5.1), (6.2), (6.3).
//
// The internal coordinates of effects with memory follow behind the model file's own: for whoever
// solves the model they are coordinates like all others, with no mass and the effect's row as their
// equation. `order` says which derivative of a coordinate its equations know.
//
// Immutable after construction: one model serves all threads, each with its own PeriodicSystem.
#pragma once

#include <memory>
#include <optional>
#include <span>
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

// Values at n points, an array per coordinate; see Points for alignment and for the excitation. A
// model that does not say needs_carrier() reads x only.
struct ModelPoints {
  int n = 0;
  const double* const* u = nullptr;
  const double* const* v = nullptr;
  const double* const* a = nullptr;
  const double* x = nullptr;  // excitation
  const double* x_quadrature = nullptr;
  const double* carrier_cos = nullptr;
  const double* carrier_sin = nullptr;
  double carrier_amplitude = 0.0, carrier_omega = 0.0;
  const double* harmonics = nullptr;
};

// Residual and partial derivatives at n points, all overwritten. g has s arrays; the Jacobians s*s,
// row (equation) by row; g_theta s*p, row by row. `scratch` has Model::scratch_arrays() arrays.
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
  // An effect in its place in the model.
  struct Term {
    const Effect* effect = nullptr;
    int first_parameter = 0;
    int first_internal = 0;  // coordinate, when it has internal ones
    int first_exciter_column = 0;
    std::vector<int> borrowed;  // the model's parameter, or -1 where `otherwise` stands
    std::vector<double> constants;
    std::vector<double> sees, acts;  // s each

    // Own and borrowed parameters, kMostParameters at most.
    void gather(const double* theta, double* local) const;
  };

  // Throws std::invalid_argument with the model file's name, the place and what is allowed, for an
  // unknown effect, parameter or constant, contradictory bounds, or a start outside them.
  explicit Model(const config::ModelSpec& spec);

  const std::string& name() const { return name_; }
  const std::string& length_unit() const { return length_unit_; }
  int coordinates() const { return static_cast<int>(order_.size()); }  // internal ones included
  int mechanical() const { return mechanical_; }                       // the first of them
  // Highest derivative of a coordinate in the equations: 2 (has inertia) or 1.
  int order(int coordinate) const { return order_[static_cast<std::size_t>(coordinate)]; }
  const std::string& coordinate_name(int coordinate) const {
    return coordinate_names_[static_cast<std::size_t>(coordinate)];
  }
  // Where a search for the equilibrium begins: 0 but for some internal coordinates.
  double rest(int coordinate) const { return rest_[static_cast<std::size_t>(coordinate)]; }
  int observed() const { return observed_; }  // the coordinate that the displacement sensor sees
  double mass(int equation, int coordinate) const {
    return mass_[static_cast<std::size_t>(equation * coordinates() + coordinate)];
  }
  // The way in which the table's acceleration enters an equation (not that of exciter effects).
  double excitation(int equation) const { return excitation_[static_cast<std::size_t>(equation)]; }
  int parameter_count() const { return static_cast<int>(parameters_.size()); }
  const std::vector<ModelParameter>& parameters() const { return parameters_; }
  std::vector<double> start() const;

  // Effects that make forces, each after those that it borrows from.
  std::span<const Term> terms() const { return terms_; }
  // Stages between the displacement and its measured number, in the order of the model file.
  std::span<const Term> instruments() const { return instruments_; }
  // Some effect wants ModelPoints' quadrature and carrier: only periodic excitations have them.
  bool needs_carrier() const { return needs_carrier_; }

  // False when a point is inadmissible. Neither allocates nor throws.
  bool evaluate(const ModelPoints& at, const double* theta, const ModelForces& out) const;
  int scratch_arrays() const { return scratch_arrays_; }

  // Not the residual but a part of it, in the same arrays: the load that goes through the damper,
  // or the motion of the base under it (a tyre's). No mass, no excitation.
  enum class Part { load, base };
  bool evaluate_part(Part part, const ModelPoints& at, const double* theta,
                     const ModelForces& out) const;

  // The excitation as the effects of the exciter correct it, n values, and its derivatives over all
  // parameters (p arrays). `scratch` as in evaluate.
  void true_excitation(const ModelPoints& at, const double* theta, double* x,
                       double* const* x_theta, double* const* scratch) const;

  bool has_velocity_kink() const { return kinked_; }
  // Jump of d2g/dv2 at v = 0 and stroke u for a model of one coordinate (Effect::velocity_kink); 0
  // for more.
  double velocity_kink(const double* theta, double u = 0.0) const;
  // Its derivative over each parameter; `theta` is put back as it was.
  void velocity_kink_gradient(std::span<double> theta, double* gradient) const;

  // Eight models abreast, each with parameters of its own: see Effect::evaluate_lanes for the order
  // of points and parameters. Returns a bit for each lane that is admissible throughout. Only for
  // models of which lanes_possible(): one coordinate, effects that need nothing else.
  bool lanes_possible() const;
  unsigned evaluate_lanes(const ModelPoints& at, const double* theta, const ModelForces& out) const;

 private:
  friend class ModelBuilder;
  bool evaluate_plain(const ModelPoints& at, const double* theta, const ModelForces& out) const;
  bool evaluate_general(const ModelPoints& at, const double* theta, const ModelForces& out) const;
  void clear(const ModelPoints& at, const double* theta, const ModelForces& out) const;
  bool add_term(const Term& term, const ModelPoints& at, const double* theta,
                const ModelForces& out) const;
  struct Share;
  Share share_of(const Term& term, const double* theta, const ModelForces& out) const;
  double* exciter_column(const Term& term, int parameter, const ModelForces& out) const;
  void spread_force(const Share& share, const ModelForces& out) const;
  void spread_rows(const Share& share, const ModelForces& out) const;
  void spread_excitation(const Share& share, const ModelForces& out) const;

  std::string name_, length_unit_;
  int mechanical_ = 1;
  int observed_ = 0;
  bool plain_ = true;  // one coordinate, forces straight into its equation
  bool needs_carrier_ = false, kinked_ = false;
  int scratch_arrays_ = 0;
  int most_parameters_ = 0, most_internals_ = 0, exciter_parameters_ = 0;
  std::vector<std::shared_ptr<const Effect>> own_effects_;  // by formula, from the model file
  std::vector<Term> terms_, instruments_;
  std::vector<ModelParameter> parameters_;
  std::vector<int> order_;
  std::vector<double> rest_;
  std::vector<std::string> coordinate_names_;
  std::vector<double> mass_;        // s*s
  std::vector<double> excitation_;  // s
};

}  // namespace shaker::estimator
