/// \file
/// An effect: one mechanism of a model (of the damper, the exciter or an instrument), with its
/// name, parameters, equations and exact partial derivatives.
///
/// A model is a sum of effects, written as accelerations on the left of (6.3),
///     u'' + sum of effects = x(t),
/// so that the "force" of an effect is per unit mass, m/s^2. An effect sees one local coordinate:
/// stroke u, velocity v, acceleration a. It evaluates arrays of many points at once, because an
/// estimate spends its time in the loops over the points.
///
/// An effect with memory also has internal coordinates w (for example the deflection of a seal
/// or the temperature of the gas). Each has an equation of its own, a row h = 0, which the model
/// solves together with its other equations:
///     f(u, v, a, x, w, w', w''; theta)          h(u, v, a, x, w, w', w''; theta) = 0
///
/// Effects of the exciter correct the recorded excitation: their force is minus the change of x.
/// Effects of an instrument have no force; model/instrument/instrument.hpp describes what they do.
///
/// effects/README.md explains how to add an effect.
#pragma once

#include <limits>
#include <span>
#include <string_view>

namespace shaker::estimator {

class Instrument;

/// What an effect belongs to.
enum class Group { damper, instrument, exciter };

/// A parameter of an effect, as the catalogue describes it.
struct ParameterInfo {
  std::string_view symbol;  ///< "theta1"
  std::string_view unit;    ///< SI, for example "1/m"; a model in feet replaces the metre
  double start;             ///< default start of an estimation
  /// Default bounds: physically admissible values.
  /// @{
  double lower, upper;
  /// @}
  std::string_view meaning;  ///< for the operator
  /// The value at which the effect vanishes, if the other parameters with such a value have it
  /// too. NaN for a parameter that only shapes the effect, or that would have to be infinite.
  double absent = std::numeric_limits<double>::quiet_NaN();
  /// Standard deviation of a normal prior about the start, where the model file states no prior.
  /// NaN: none.
  double spread = std::numeric_limits<double>::quiet_NaN();
};

/// A constant of an effect: the model file gives it, and no fit changes it.
struct ConstantInfo {
  /// Name in the model file, and SI unit.
  /// @{
  std::string_view symbol, unit;
  /// @}
  double value;              ///< default
  std::string_view meaning;  ///< for the operator
  bool width = false;        ///< a smoothing width or a scale: must be above 0
  bool reach = false;        ///< the stroke up to which the effect's shape is meant
};

/// An internal coordinate of an effect with memory.
struct InternalInfo {
  /// Name, and SI unit.
  /// @{
  std::string_view symbol, unit;
  /// @}
  int order;                 ///< highest derivative in its row: 1 or 2
  double start;              ///< value at rest: start of a search for the equilibrium
  std::string_view meaning;  ///< for the operator
};

/// A parameter of another effect that the formula of this one contains, as in
/// mu P(theta2, theta3, theta4). Values and columns of derivatives of borrowed parameters follow
/// those of the effect's own parameters.
struct Borrowed {
  /// The lender and its parameter.
  /// @{
  std::string_view effect, symbol;
  /// @}
  double otherwise =
      std::numeric_limits<double>::quiet_NaN();  ///< value without the lender; NaN: lender needed
  bool displaced = false;  ///< the lender's parameter loses its influence; the model then fixes it
};

inline constexpr int kMostParameters = 16;  ///< of one effect, own and borrowed
/// Most internal coordinates of one effect.
inline constexpr int kMostInternals = 2;
inline constexpr int kCarriedHarmonics = 5;  ///< of the excitation, available to effects one by one

/// n points of one coordinate, in SI or the model's length unit. Arrays are 64-byte aligned and
/// readable up to the next multiple of 8. Arrays of the excitation may be null unless the effect
/// asks for them.
struct Points {
  int n = 0;                  ///< number of points
  const double* u = nullptr;  ///< stroke, n values
  const double* v = nullptr;  ///< velocity, unit of u per s
  const double* a = nullptr;  ///< acceleration, unit of u per s^2
  /// Internal coordinates: one array for each.
  const double* const* w = nullptr;
  const double* const* w_dot = nullptr;   ///< their first derivatives over time
  const double* const* w_ddot = nullptr;  ///< their second derivatives over time
  /// Excitation: x is its acceleration; x_quadrature is x with every harmonic a quarter of its
  /// period late. The fundamental is amplitude * carrier_cos. Harmonic h <= kCarriedHarmonics of
  /// x is harmonics[2 h - 2] cos(h phase) + harmonics[2 h - 1] sin(h phase), where the phase is
  /// the carrier's and advances by carrier_omega (rad/s).
  const double* x = nullptr;
  const double* x_quadrature = nullptr;  ///< in the unit of x
  const double* carrier_cos = nullptr;   ///< cosine of the phase at each point
  const double* carrier_sin = nullptr;   ///< sine of the phase at each point
  /// Amplitude of the fundamental, m/s^2, and its angular frequency, rad/s.
  /// @{
  double carrier_amplitude = 0.0, carrier_omega = 0.0;
  /// @}
  const double* harmonics = nullptr;  ///< 2 * kCarriedHarmonics coefficients, m/s^2
};

/// Force, rows and their partial derivatives at the points. `evaluate` adds to f, f_u, f_v, f_a
/// and overwrites the others. With k internal coordinates: f_w.. have k arrays, h.. k,
/// h_w.. k * k (row by row), h_theta k * (own + borrowed parameters). Null for what an effect
/// does not have.
struct Forces {
  double* f = nullptr;               ///< force, m/s^2
  double* f_u = nullptr;             ///< over u
  double* f_v = nullptr;             ///< over v
  double* f_a = nullptr;             ///< over a
  double* const* f_theta = nullptr;  ///< one array a parameter: own, then borrowed
  double* f_x = nullptr;         ///< only for effects that see the excitation, except the exciter's
  double* const* f_w = nullptr;  ///< over each internal coordinate
  double* const* f_w_dot = nullptr;   ///< over its first derivative
  double* const* f_w_ddot = nullptr;  ///< over its second derivative
  double* const* h = nullptr;         ///< the rows
  double* const* h_u = nullptr;       ///< of each row over u
  double* const* h_v = nullptr;       ///< of each row over v
  double* const* h_a = nullptr;       ///< of each row over a
  double* const* h_x = nullptr;       ///< of each row over x
  double* const* h_w = nullptr;       ///< of each row over each internal coordinate
  double* const* h_w_dot = nullptr;   ///< over its first derivative
  double* const* h_w_ddot = nullptr;  ///< over its second derivative
  double* const* h_theta = nullptr;   ///< of each row over each parameter
};

/// One mechanism: name, parameters, equations, derivatives. Immutable; all threads may use one
/// object.
class Effect {
 public:
  virtual ~Effect() = default;
  /// \return the name in model files
  virtual std::string_view name() const = 0;
  /// \return the formula, for display: "theta1 |v| v"
  virtual std::string_view formula() const = 0;
  /// \return the meaning, for the operator: "dry friction of the seals"
  virtual std::string_view meaning() const = 0;
  /// \return what it belongs to
  virtual Group group() const { return Group::damper; }
  /// \return its own parameters, in the order of theta; at most kMostParameters with the borrowed
  ///   ones
  virtual std::span<const ParameterInfo> parameters() const { return {}; }
  /// \return its constants, in the order of `constants` of evaluate()
  virtual std::span<const ConstantInfo> constants() const { return {}; }
  /// \return its internal coordinates, at most kMostInternals
  virtual std::span<const InternalInfo> internals() const { return {}; }
  /// \return the parameters that it borrows, in the order in which they follow its own
  virtual std::span<const Borrowed> borrows() const { return {}; }

  /// \return true if it needs Points::x
  virtual bool sees_excitation() const { return false; }
  /// \return true if it needs the other data of the excitation, which must then be periodic
  virtual bool needs_carrier() const { return false; }
  /// Weight and inertia are not part of the load that a load cell measures.
  /// \return true if a load cell between damper and mass measures its force
  virtual bool carries_load() const { return group() == Group::damper; }
  /// \return true if its force is the acceleration of the base under the damper (a tyre) and not a
  ///   load
  virtual bool moves_base() const { return false; }
  /// \return the instrument of an effect that changes the measurement and not the motion, or
  ///   nullptr
  virtual const Instrument* instrument() const { return nullptr; }
  /// \return true if it is between damper and mass, so that it transmits all loads
  virtual bool in_series() const { return false; }
  /// \return the same as a part in series, of the same name and parameters, if that is another effect:
  ///   a joint within the measured length, along an imposed motion
  virtual const Effect& as_part_in_series() const { return *this; }

  /// Adds the effect at the points `at`. Neither allocates nor throws.
  /// \param at n points
  /// \param theta own, then borrowed parameters, in the model's units
  /// \param constants in the order of constants()
  /// \param out arrays of n values
  /// \return false if a point is inadmissible (for example 1 - theta3 u <= 0); `out` is then
  ///   unspecified
  virtual bool evaluate(const Points& at, const double* theta, const double* constants,
                        const Forces& out) const = 0;

  /// The same for eight models in the lanes of a batch. Point i belongs to lane i % 8, parameter
  /// k of lane l is theta[8 k + l], and at.n is a multiple of 8. Only for effects that have no
  /// internal coordinates and do not see the excitation. This default separates the lanes and calls
  /// `evaluate`; effects in the hot loop override it.
  /// \param at points of eight models in turn
  /// \param theta parameters of eight models in turn
  /// \param constants in the order of constants()
  /// \param out arrays of n values
  /// \return bit l: lane l is admissible at all its points
  virtual unsigned evaluate_lanes(const Points& at, const double* theta, const double* constants,
                                  const Forces& out) const;

  /// \return true if velocity_kink() may differ from 0
  virtual bool has_velocity_kink() const { return false; }
  /// Jump of the second derivative of the force over v, at the velocity reversal (v = 0) and
  /// stroke u. |v| v has such a jump; it limits every fixed grid to third order. 0 for a smooth
  /// effect. The arguments: own and borrowed parameters, constants, and u.
  /// \return the jump, m/s^2 over (m/s)^2
  virtual double velocity_kink(const double* /*theta*/, const double* /*constants*/,
                               double /*u*/) const {
    return 0.0;
  }
};

}  // namespace shaker::estimator
