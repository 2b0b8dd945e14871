// An effect: one mechanism of a model (of the damper, the exciter or an instrument), with its
// name, parameters, equations and exact partial derivatives.
//
// A model is a sum of effects, written as accelerations on the left of (6.3),
//     u'' + sum of effects = x(t),
// so that the "force" of an effect is per unit mass, m/s^2. An effect sees one local coordinate:
// stroke u, velocity v, acceleration a. It evaluates arrays of many points at once, because an
// estimate spends its time in the loops over the points.
//
// An effect with memory also has internal coordinates w (for example the deflection of a seal
// or the temperature of the gas). Each has an equation of its own, a row h = 0, which the model
// solves together with its other equations:
//     f(u, v, a, x, w, w', w''; theta)          h(u, v, a, x, w, w', w''; theta) = 0
//
// Effects of the exciter correct the recorded excitation: their force is minus the change of x.
// Effects of an instrument have no force; instrument/instrument.hpp describes what they do.
//
// effects/README.md explains how to add an effect.
#pragma once

#include <limits>
#include <span>
#include <string_view>

namespace shaker::estimator {

class Instrument;

enum class Group { damper, instrument, exciter };

struct ParameterInfo {
  std::string_view symbol;  // "theta1"
  std::string_view unit;    // SI, for example "1/m"; a model in feet replaces the metre
  double start;             // default start of an estimation
  double lower, upper;      // default bounds: physically admissible values
  std::string_view meaning;
  // The value at which the effect vanishes, if the other parameters with such a value have it
  // too. NaN for a parameter that only shapes the effect, or that would have to be infinite.
  double absent = std::numeric_limits<double>::quiet_NaN();
};

struct ConstantInfo {
  std::string_view symbol, unit;
  double value;
  std::string_view meaning;
  bool width = false;  // a smoothing width or a scale: must be above 0
};

struct InternalInfo {
  std::string_view symbol, unit;
  int order;     // highest derivative in its row: 1 or 2
  double start;  // value at rest: start of a search for the equilibrium
  std::string_view meaning;
};

// A parameter of another effect that the formula of this one contains, as in
// mu P(theta2, theta3, theta4). Values and columns of derivatives of borrowed parameters follow
// those of the effect's own parameters.
struct Borrowed {
  std::string_view effect, symbol;
  double otherwise =
      std::numeric_limits<double>::quiet_NaN();  // value without the lender; NaN: lender needed
  bool displaced = false;  // the lender's parameter loses its influence; the model then fixes it
};

inline constexpr int kMostParameters = 16;  // of one effect, own and borrowed
inline constexpr int kMostInternals = 2;
inline constexpr int kCarriedHarmonics = 5;  // of the excitation, available to effects one by one

// n points of one coordinate, in SI or the model's length unit. Arrays are 64-byte aligned and
// readable up to the next multiple of 8. Arrays of the excitation may be null unless the effect
// asks for them.
struct Points {
  int n = 0;
  const double* u = nullptr;
  const double* v = nullptr;
  const double* a = nullptr;
  // Internal coordinates: one array for each.
  const double* const* w = nullptr;
  const double* const* w_dot = nullptr;
  const double* const* w_ddot = nullptr;
  // Excitation: x is its acceleration; x_quadrature is x with every harmonic a quarter of its
  // period late. The fundamental is amplitude * carrier_cos. Harmonic h <= kCarriedHarmonics of
  // x is harmonics[2 h - 2] cos(h phase) + harmonics[2 h - 1] sin(h phase), where the phase is
  // the carrier's and advances by carrier_omega (rad/s).
  const double* x = nullptr;
  const double* x_quadrature = nullptr;
  const double* carrier_cos = nullptr;
  const double* carrier_sin = nullptr;
  double carrier_amplitude = 0.0, carrier_omega = 0.0;
  const double* harmonics = nullptr;
};

// Force, rows and their partial derivatives at the points. `evaluate` adds to f, f_u, f_v, f_a
// and overwrites the others. With k internal coordinates: f_w.. have k arrays, h.. k,
// h_w.. k * k (row by row), h_theta k * (own + borrowed parameters). Null for what an effect
// does not have.
struct Forces {
  double* f = nullptr;
  double* f_u = nullptr;
  double* f_v = nullptr;
  double* f_a = nullptr;
  double* const* f_theta = nullptr;  // one array a parameter: own, then borrowed
  double* f_x = nullptr;  // only for effects that see the excitation, except the exciter's
  double* const* f_w = nullptr;
  double* const* f_w_dot = nullptr;
  double* const* f_w_ddot = nullptr;
  double* const* h = nullptr;
  double* const* h_u = nullptr;
  double* const* h_v = nullptr;
  double* const* h_a = nullptr;
  double* const* h_x = nullptr;
  double* const* h_w = nullptr;
  double* const* h_w_dot = nullptr;
  double* const* h_w_ddot = nullptr;
  double* const* h_theta = nullptr;
};

// Immutable; all threads may use one object.
class Effect {
 public:
  virtual ~Effect() = default;
  virtual std::string_view name() const = 0;
  virtual std::string_view formula() const = 0;  // for display: "theta1 |v| v"
  virtual std::string_view meaning() const = 0;  // for the operator: "dry friction of the seals"
  virtual Group group() const { return Group::damper; }
  virtual std::span<const ParameterInfo> parameters() const { return {}; }
  virtual std::span<const ConstantInfo> constants() const { return {}; }
  virtual std::span<const InternalInfo> internals() const { return {}; }
  virtual std::span<const Borrowed> borrows() const { return {}; }

  // sees_excitation: it needs Points::x. needs_carrier: it needs the other data of the
  // excitation, which must then be periodic.
  virtual bool sees_excitation() const { return false; }
  virtual bool needs_carrier() const { return false; }
  // True if a load cell between damper and mass measures its force. Weight and inertia are not
  // part of that load.
  virtual bool carries_load() const { return group() == Group::damper; }
  // True if its force is the acceleration of the base under the damper (a tyre) and not a load.
  virtual bool moves_base() const { return false; }
  // Non-null for an effect that changes the measurement and not the motion.
  virtual const Instrument* instrument() const { return nullptr; }
  // True if it is between damper and mass, so that it transmits all loads.
  virtual bool in_series() const { return false; }

  // Adds the effect at the points `at`. `theta` holds own, then borrowed parameters. Returns
  // false if a point is inadmissible (for example 1 - theta3 u <= 0); the output is then
  // unspecified. Neither allocates nor throws.
  virtual bool evaluate(const Points& at, const double* theta, const double* constants,
                        const Forces& out) const = 0;

  // The same for eight models in the lanes of a batch. Point i belongs to lane i % 8, parameter
  // k of lane l is theta[8 k + l], and at.n is a multiple of 8. Returns a bit for each lane
  // that is admissible at all its points. Only for effects that have no internal coordinates
  // and do not see the excitation. This default separates the lanes and calls `evaluate`;
  // effects in the hot loop override it.
  virtual unsigned evaluate_lanes(const Points& at, const double* theta, const double* constants,
                                  const Forces& out) const;

  virtual bool has_velocity_kink() const { return false; }
  // Jump of the second derivative of the force over v, at the velocity reversal (v = 0) and
  // stroke u. |v| v has such a jump; it limits every fixed grid to third order. 0 for a smooth
  // effect.
  virtual double velocity_kink(const double* /*theta*/, const double* /*constants*/,
                               double /*u*/) const {
    return 0.0;
  }
};

}  // namespace shaker::estimator
