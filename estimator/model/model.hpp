/// \file
/// A model of the damper on the table: a sum of effects on the generalised coordinates, written
/// as a residual,
///
///     g(u, u', u''; x, theta) = M u'' + sum over effects of w f(c.u, c.u', c.u''; theta)
///                                     - e x(t) = 0
///
/// u: the s coordinates (s = 1 for the oleo: its stroke). M: the mass matrix over the reference
/// mass. c: the combination of coordinates that an effect sees. w: the equations in which its
/// force acts. e: how the table's acceleration x enters the equations. (5.1), (6.2), (6.3).
///
/// The coordinates of the model file come first. Further coordinates follow: that of an effect in
/// series, and the internal coordinates of effects with memory. For a solver they are coordinates
/// like the others, but without mass. The equation of an internal coordinate is the effect's row.
/// `order` is the highest derivative of a coordinate in the equations.
///
/// Immutable after construction: all threads may use one model, each with its own PeriodicSystem.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/model.hpp"
#include "estimator/model/effects/effect.hpp"

namespace shaker::estimator {

/// A parameter of a model.
struct ModelParameter {
  std::string name;    ///< unique in the model
  std::string effect;  ///< the effect that has it
  /// Its line among the model file's effects, and its symbol there.
  /// @{
  std::size_t line = 0;
  std::string symbol;
  /// @}
  std::string unit;  ///< in the model's own length unit
  /// Start and bounds, in `unit`.
  /// @{
  double start = 0.0, lower = 0.0, upper = 0.0;
  /// @}
  bool fixed = false;  ///< the fit leaves it at its start
  /// Both or none: normal prior (3.8).
  /// @{
  std::optional<double> prior_mean, prior_standard_deviation;
  /// @}
  config::RunVariation variation;  ///< from run to run; run_models.hpp gives each run its own
};

/// Values at n points, one array a coordinate. See Points for alignment and for the excitation. A
/// model reads x only, unless needs_carrier().
struct ModelPoints {
  int n = 0;                             ///< number of points
  const double* const* u = nullptr;      ///< coordinates
  const double* const* v = nullptr;      ///< their velocities, unit of u per s
  const double* const* a = nullptr;      ///< their accelerations, unit of u per s^2
  const double* x = nullptr;             ///< excitation
  const double* x_quadrature = nullptr;  ///< as in Points
  const double* carrier_cos = nullptr;   ///< as in Points
  const double* carrier_sin = nullptr;   ///< as in Points
  /// As in Points: m/s^2 and rad/s.
  /// @{
  double carrier_amplitude = 0.0, carrier_omega = 0.0;
  /// @}
  const double* harmonics = nullptr;  ///< 2 * kCarriedHarmonics coefficients, m/s^2
};

/// Residual and partial derivatives at n points; evaluate overwrites all of them. g: s arrays;
/// the Jacobians: s x s, row (equation) by row; g_theta: s x p, row by row, or null if a model of
/// several coordinates is not to compute it. `scratch`: Model::scratch_arrays() arrays. Every array
/// holds n values.
struct ModelForces {
  double* const* g = nullptr;        ///< residual of each equation, m/s^2
  double* const* g_u = nullptr;      ///< over each coordinate
  double* const* g_v = nullptr;      ///< over each velocity
  double* const* g_a = nullptr;      ///< over each acceleration
  double* const* g_theta = nullptr;  ///< over each parameter
  double* const* scratch = nullptr;  ///< room for intermediate values
};

/// The equations of motion. Immutable; all threads may use one object.
class Model {
 public:
  /// An effect and its place in the model.
  struct Term {
    const Effect* effect = nullptr;  ///< lives as long as the model
    int first_parameter = 0;         ///< index of its first own parameter in the model's
    int first_internal = 0;          ///< its first internal coordinate, if it has any
    int first_exciter_column =
        0;  ///< of the exciter's effects: index of the first column of derivatives
    std::vector<int> borrowed;      ///< index of the model's parameter; -1: use `otherwise`
    std::vector<double> constants;  ///< values, in the effect's order
    /// The combination of coordinates that it sees, and the equations in which its force acts; s
    /// values each.
    /// @{
    std::vector<double> sees, acts;
    /// @}

    /// In a model of one run among several (run_models.hpp): where its own parameters are. Empty:
    /// from first_parameter on.
    std::vector<int> own;
    /// Factors of its own and borrowed parameters in this run. Empty: 1 each.
    std::vector<double> factors;

    /// \param k number of one of the effect's own parameters
    /// \return its index among the model's
    int parameter(std::size_t k) const {
      return own.empty() ? first_parameter + static_cast<int>(k) : own[k];
    }
    /// \param k number of one of the effect's own parameters, then of the borrowed ones
    /// \return its factor in this run
    double factor(std::size_t k) const { return factors.empty() ? 1.0 : factors[k]; }
    /// Copies own, then borrowed parameters from theta (all) to local (at most kMostParameters).
    /// \param theta all parameters of the model
    /// \param local receives own, then borrowed ones
    void gather(const double* theta, double* local) const;
  };

  /// Throws std::invalid_argument for an unknown effect, parameter or constant, contradictory
  /// bounds or a start outside them. The message names the model file and the place.
  /// Parameters with known values for runs or groups are spread over them (run_models.hpp), and the
  /// model is that of the first.
  /// \param spec the content of a model file
  explicit Model(const config::ModelSpec& spec);

  /// \return the name of the model
  const std::string& name() const { return name_; }
  /// \return the length unit, for example "m"
  const std::string& length_unit() const { return length_unit_; }
  /// \return the number s of coordinates, internal ones included
  int coordinates() const { return static_cast<int>(order_.size()); }
  /// \return the number of coordinates of the model file
  int mechanical() const { return mechanical_; }
  /// Highest derivative of a coordinate in the equations: 2 (has inertia) or 1.
  /// \param coordinate index from 0
  /// \return 1 or 2
  int order(int coordinate) const { return order_[static_cast<std::size_t>(coordinate)]; }
  /// \param coordinate index from 0
  /// \return its name
  const std::string& coordinate_name(int coordinate) const {
    return coordinate_names_[static_cast<std::size_t>(coordinate)];
  }
  /// \return index of the damper's own stroke, behind a part in series; -1 where there is none
  int coordinate_in_series() const { return coordinate_in_series_; }
  /// Start value of a search for the equilibrium: 0 except for some internal coordinates.
  /// \param coordinate index from 0
  /// \return the start value
  double rest(int coordinate) const { return rest_[static_cast<std::size_t>(coordinate)]; }
  /// \return index of the coordinate that the displacement sensor sees
  int observed() const { return observed_; }
  /// \param equation index from 0
  /// \param coordinate index from 0
  /// \return the element of the mass matrix over the reference mass
  double mass(int equation, int coordinate) const {
    return mass_[static_cast<std::size_t>(equation * coordinates() + coordinate)];
  }
  /// Factor of the table's acceleration in an equation, before the effects of the exciter.
  /// \param equation index from 0
  /// \return the factor
  double excitation(int equation) const { return excitation_[static_cast<std::size_t>(equation)]; }
  /// \return the number p of parameters, fixed ones included
  int parameter_count() const { return static_cast<int>(parameters_.size()); }
  /// \return all parameters; theta has their order
  const std::vector<ModelParameter>& parameters() const { return parameters_; }
  /// \return the start of each parameter
  std::vector<double> start() const;

  /// Effects with forces; each comes after those whose parameters it borrows.
  /// \return the effects, in order of evaluation
  std::span<const Term> terms() const { return terms_; }
  /// Instrument stages between displacement and measured value, in the order of the model file.
  /// \return the stages
  std::span<const Term> instruments() const { return instruments_; }
  /// \return true if an effect needs ModelPoints' quadrature and carrier, which only a periodic
  ///   excitation has
  bool needs_carrier() const { return needs_carrier_; }

  /// Residual and derivatives; theta holds all parameters. Neither allocates nor throws.
  /// \param at n points
  /// \param theta p parameters, in the model's units
  /// \param out receives residual and derivatives
  /// \return false if a point is inadmissible; `out` is then unspecified
  bool evaluate(const ModelPoints& at, const double* theta, const ModelForces& out) const;
  /// \return the number of arrays that ModelForces::scratch must hold
  int scratch_arrays() const { return scratch_arrays_; }

  /// The equations of the internal coordinates alone, in the same arrays. The other equations are
  /// incomplete afterwards. Only for models with internal coordinates.
  /// \param at n points
  /// \param theta p parameters
  /// \param out receives residual and derivatives
  /// \return true if all points are admissible
  bool evaluate_internal(const ModelPoints& at, const double* theta, const ModelForces& out) const;

  /// A part of the residual: the load that the damper carries, or the motion of the base under it
  /// (a tyre).
  enum class Part { load, base };
  /// A part of the residual in the same arrays. Mass and table excitation are not included.
  /// \param part which part
  /// \param at n points
  /// \param theta p parameters
  /// \param out receives the part and its derivatives
  /// \return true if all points are admissible
  bool evaluate_part(Part part, const ModelPoints& at, const double* theta,
                     const ModelForces& out) const;

  /// The excitation as corrected by the effects of the exciter (n values), and its derivatives
  /// with respect to all parameters (p arrays). `scratch` as in evaluate.
  /// \param at n points
  /// \param theta p parameters
  /// \param x receives n values, m/s^2
  /// \param x_theta receives p arrays of n values
  /// \param scratch arrays of n values
  void true_excitation(const ModelPoints& at, const double* theta, double* x,
                       double* const* x_theta, double* const* scratch) const;

  /// \return true if velocity_kink() may differ from 0
  bool has_velocity_kink() const { return kinked_; }
  /// Jump of d2g/dv2 at v = 0 and stroke u (Effect::velocity_kink). 0 for a model of several
  /// coordinates, or whose effects do not see and act on the only one with weight 1.
  /// \param theta p parameters
  /// \param u stroke, in the model's length unit
  /// \return the jump, 1 over the length unit
  double velocity_kink(const double* theta, double u = 0.0) const;
  /// Derivative of velocity_kink with respect to each parameter. `theta` changes meanwhile.
  /// \param theta p parameters; unchanged on return
  /// \param gradient receives p values
  void velocity_kink_gradient(std::span<double> theta, double* gradient) const;

  /// Whether eight models can be evaluated together: one coordinate, and no effect with an
  /// instrument, an exciter, a carrier, borrowed parameters or a force of the excitation.
  /// \return true if evaluate_lanes() may be called
  bool lanes_possible() const;
  /// Eight models in the lanes of a batch, each with its own parameters. Effect::evaluate_lanes
  /// defines the order of points and parameters. Only if lanes_possible().
  /// \param at points of eight models in turn
  /// \param theta parameters of eight models in turn
  /// \param out receives residual and derivatives
  /// \return bit l: lane l is admissible
  unsigned evaluate_lanes(const ModelPoints& at, const double* theta, const ModelForces& out) const;

 private:
  friend class ModelBuilder;
  friend class RunModelMaker;
  Model() = default;
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
  std::vector<int> idle_;  // parameters of other runs (run_models.hpp)
  int scratch_arrays_ = 0;
  int most_parameters_ = 0, most_internals_ = 0, exciter_parameters_ = 0;
  std::vector<std::shared_ptr<const Effect>> own_effects_;  // given by formula in the model file
  std::vector<Term> terms_, instruments_;
  std::vector<ModelParameter> parameters_;
  std::vector<int> order_;
  std::vector<double> rest_;
  std::vector<std::string> coordinate_names_;
  int coordinate_in_series_ = -1;
  std::vector<double> mass_;        // s*s
  std::vector<double> excitation_;  // s
};

}  // namespace shaker::estimator
