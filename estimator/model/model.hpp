// A model of the damper on the table: a sum of effects on the generalised coordinates, written
// as a residual,
//
//     g(u, u', u''; x, theta) = M u'' + sum over effects of w f(c.u, c.u', c.u''; theta)
//                                     - e x(t) = 0
//
// u: the s coordinates (s = 1 for the oleo: its stroke). M: the mass matrix over the reference
// mass. c: the combination of coordinates that an effect sees. w: the equations in which its
// force acts. e: how the table's acceleration x enters the equations. (5.1), (6.2), (6.3).
//
// The coordinates of the model file come first. Further coordinates follow: that of an effect in
// series, and the internal coordinates of effects with memory. For a solver they are coordinates
// like the others, but without mass. The equation of an internal coordinate is the effect's row.
// `order` is the highest derivative of a coordinate in the equations.
//
// Immutable after construction: all threads may use one model, each with its own PeriodicSystem.
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

// Values at n points, one array a coordinate. See Points for alignment and for the excitation. A
// model reads x only, unless needs_carrier().
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

// Residual and partial derivatives at n points; evaluate overwrites all of them. g: s arrays;
// the Jacobians: s x s, row (equation) by row; g_theta: s x p, row by row, or null if a model of
// several coordinates is not to compute it. `scratch`: Model::scratch_arrays() arrays. Every array
// holds n values.
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
  // An effect and its place in the model.
  struct Term {
    const Effect* effect = nullptr;
    int first_parameter = 0;
    int first_internal = 0;  // its first internal coordinate, if it has any
    int first_exciter_column = 0;
    std::vector<int> borrowed;  // index of the model's parameter; -1: use `otherwise`
    std::vector<double> constants;
    std::vector<double> sees, acts;  // s each

    // Copies own, then borrowed parameters from theta (all) to local (at most kMostParameters).
    void gather(const double* theta, double* local) const;
  };

  // Throws std::invalid_argument for an unknown effect, parameter or constant, contradictory
  // bounds or a start outside them. The message names the model file and the place.
  explicit Model(const config::ModelSpec& spec);

  const std::string& name() const { return name_; }
  const std::string& length_unit() const { return length_unit_; }
  int coordinates() const { return static_cast<int>(order_.size()); }  // internal ones included
  int mechanical() const { return mechanical_; }                       // those of the model file
  // Highest derivative of a coordinate in the equations: 2 (has inertia) or 1.
  int order(int coordinate) const { return order_[static_cast<std::size_t>(coordinate)]; }
  const std::string& coordinate_name(int coordinate) const {
    return coordinate_names_[static_cast<std::size_t>(coordinate)];
  }
  // Start value of a search for the equilibrium: 0 except for some internal coordinates.
  double rest(int coordinate) const { return rest_[static_cast<std::size_t>(coordinate)]; }
  int observed() const { return observed_; }  // the coordinate that the displacement sensor sees
  double mass(int equation, int coordinate) const {
    return mass_[static_cast<std::size_t>(equation * coordinates() + coordinate)];
  }
  // Factor of the table's acceleration in an equation, before the effects of the exciter.
  double excitation(int equation) const { return excitation_[static_cast<std::size_t>(equation)]; }
  int parameter_count() const { return static_cast<int>(parameters_.size()); }
  const std::vector<ModelParameter>& parameters() const { return parameters_; }
  std::vector<double> start() const;

  // Effects with forces; each comes after those whose parameters it borrows.
  std::span<const Term> terms() const { return terms_; }
  // Instrument stages between displacement and measured value, in the order of the model file.
  std::span<const Term> instruments() const { return instruments_; }
  // True if an effect needs ModelPoints' quadrature and carrier, which only a periodic
  // excitation has.
  bool needs_carrier() const { return needs_carrier_; }

  // Residual and derivatives; theta holds all parameters. Returns false if a point is
  // inadmissible. Neither allocates nor throws.
  bool evaluate(const ModelPoints& at, const double* theta, const ModelForces& out) const;
  int scratch_arrays() const { return scratch_arrays_; }

  // The equations of the internal coordinates alone, in the same arrays. The other equations are
  // incomplete afterwards. Only for models with internal coordinates.
  bool evaluate_internal(const ModelPoints& at, const double* theta, const ModelForces& out) const;

  // A part of the residual in the same arrays: the load that the damper carries, or the motion
  // of the base under it (a tyre). Mass and table excitation are not included.
  enum class Part { load, base };
  bool evaluate_part(Part part, const ModelPoints& at, const double* theta,
                     const ModelForces& out) const;

  // The excitation as corrected by the effects of the exciter (n values), and its derivatives
  // with respect to all parameters (p arrays). `scratch` as in evaluate.
  void true_excitation(const ModelPoints& at, const double* theta, double* x,
                       double* const* x_theta, double* const* scratch) const;

  bool has_velocity_kink() const { return kinked_; }
  // Jump of d2g/dv2 at v = 0 and stroke u (Effect::velocity_kink). 0 for a model of several
  // coordinates, or whose effects do not see and act on the only one with weight 1.
  double velocity_kink(const double* theta, double u = 0.0) const;
  // Derivative of velocity_kink with respect to each parameter. `theta` changes meanwhile.
  void velocity_kink_gradient(std::span<double> theta, double* gradient) const;

  // Eight models in the lanes of a batch, each with its own parameters. Effect::evaluate_lanes
  // defines the order of points and parameters. Returns a bit for each lane that is admissible
  // at all its points. Only if lanes_possible(): one coordinate, and no effect with an
  // instrument, an exciter, a carrier, borrowed parameters or a force of the excitation.
  bool lanes_possible() const;
  unsigned evaluate_lanes(const ModelPoints& at, const double* theta, const ModelForces& out) const;

 private:
  friend class ModelBuilder;
  bool evaluate_plain(const ModelPoints& at, const double* theta, const ModelForces& out) const;
  bool evaluate_general(const ModelPoints& at, const double* theta, const ModelForces& out) const;
  void clear(const ModelPoints& at, const double* theta, const ModelForces& out) const;
  void add_inertia(int first, const ModelPoints& at, const ModelForces& out) const;
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
  bool plain_ = true;  // one coordinate; effects add directly to its equation
  bool needs_carrier_ = false, kinked_ = false;
  int scratch_arrays_ = 0;
  int most_parameters_ = 0, most_internals_ = 0, exciter_parameters_ = 0;
  std::vector<std::shared_ptr<const Effect>> own_effects_;  // given by formula in the model file
  std::vector<Term> terms_, instruments_;
  std::vector<ModelParameter> parameters_;
  std::vector<int> order_;
  std::vector<double> rest_;
  std::vector<std::string> coordinate_names_;
  std::vector<double> mass_;        // s*s
  std::vector<double> excitation_;  // s
};

}  // namespace shaker::estimator
