// An effect: one mechanism of a model (of the damper, of the exciter or of an instrument), with a
// name, its parameters, its equations and their exact partial derivatives.
//
// A model is a sum of effects written as accelerations on the left of (6.3),
//     u'' + sum of effects = x(t),
// so that an effect's "force" is per unit mass, m/s^2. An effect sees one local coordinate: stroke
// u, velocity v, acceleration a, at many points at once (arrays), because the loops over the points
// are where the time of an estimate goes.
//
// An effect with memory has internal coordinates w besides (the deflection of a seal, the
// temperature of the gas), each with an equation of its own, a row h = 0, that the model solves
// together with its own:
//     f(u, v, a, x, w, w', w''; theta)          h(u, v, a, x, w, w', w''; theta) = 0
//
// Effects of the exciter say what the excitation really is: their force is minus the change of x.
// Effects of an instrument have no force; they say what is seen (instrument/instrument.hpp).
//
// Adding one: effects/README.md.
#pragma once

#include <limits>
#include <span>
#include <string_view>

namespace shaker::estimator {

class Instrument;

enum class Group { damper, instrument, exciter };

struct ParameterInfo {
  std::string_view symbol;  // "theta1"
  std::string_view unit;    // in SI: "1/m"; models in feet relabel the metre
  double start;             // where to begin when nothing is said
  double lower, upper;      // physically admissible
  std::string_view meaning;
  // The value at which (with the other such parameters at theirs) the effect is as if it were not
  // there; NaN for a parameter that only shapes it, or that would have to be infinite.
  double absent = std::numeric_limits<double>::quiet_NaN();
};

struct ConstantInfo {
  std::string_view symbol, unit;
  double value;
  std::string_view meaning;
  bool width = false;  // of a smoothed edge: must be above 0
};

struct InternalInfo {
  std::string_view symbol, unit;
  int order;     // the highest derivative in its row: 1 or 2
  double start;  // at rest, where a search for the equilibrium begins
  std::string_view meaning;
};

// A parameter of another effect that this one is stated in: mu P(theta2, theta3, theta4). Its value
// stands behind the own parameters, and so does its column of derivatives.
struct Borrowed {
  std::string_view effect, symbol;
  double otherwise =
      std::numeric_limits<double>::quiet_NaN();  // value without the lender; NaN: lender needed
  bool displaced = false;  // the lender's parameter has no influence left: the model fixes it
};

inline constexpr int kMostParameters = 16;  // own and borrowed, of one effect
inline constexpr int kMostInternals = 2;
inline constexpr int kCarriedHarmonics = 5;  // of the excitation, that effects see one by one

// n points of one coordinate. Arrays are 64-byte aligned and readable up to the next multiple of 8.
// Those of the excitation are null unless the effect says that it wants them.
struct Points {
  int n = 0;
  const double* u = nullptr;
  const double* v = nullptr;
  const double* a = nullptr;
  // Internal coordinates, an array each.
  const double* const* w = nullptr;
  const double* const* w_dot = nullptr;
  const double* const* w_ddot = nullptr;
  // Excitation: acceleration x; the same with every harmonic a quarter of its period late
  // (quadrature); its fundamental is amplitude * carrier_cos. Harmonic h <= kCarriedHarmonics of x
  // is harmonics[2 h - 2] cos(h phase) + harmonics[2 h - 1] sin(h phase), phase being the
  // carrier's, which turns by carrier_omega (rad/s).
  const double* x = nullptr;
  const double* x_quadrature = nullptr;
  const double* carrier_cos = nullptr;
  const double* carrier_sin = nullptr;
  double carrier_amplitude = 0.0, carrier_omega = 0.0;
  const double* harmonics = nullptr;
};

// Force, rows and their partial derivatives at the points. `evaluate` adds to f, f_u, f_v, f_a and
// overwrites all else. With k internal coordinates: f_w.. have k arrays, h.. k, h_w.. k * k (row by
// row), h_theta k * (own + borrowed parameters). Null where an effect has no such thing.
struct Forces {
  double* f = nullptr;
  double* f_u = nullptr;
  double* f_v = nullptr;
  double* f_a = nullptr;
  double* const* f_theta = nullptr;  // one array a parameter, own ones first, then borrowed
  double* f_x = nullptr;  // for effects that see the excitation and are not the exciter's
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

// Immutable; one object serves all threads.
class Effect {
 public:
  virtual ~Effect() = default;
  virtual std::string_view name() const = 0;
  virtual std::string_view formula() const = 0;  // for people: "theta1 |v| v"
  virtual std::string_view meaning() const = 0;  // for an operator: "dry friction of the seals"
  virtual Group group() const { return Group::damper; }
  virtual std::span<const ParameterInfo> parameters() const { return {}; }
  virtual std::span<const ConstantInfo> constants() const { return {}; }
  virtual std::span<const InternalInfo> internals() const { return {}; }
  virtual std::span<const Borrowed> borrows() const { return {}; }

  // Wants Points::x / the rest of the excitation, which only a periodic one has.
  virtual bool sees_excitation() const { return false; }
  virtual bool needs_carrier() const { return false; }
  // Part of the load that a load cell between damper and mass would show. Weight and inertia are
  // not.
  virtual bool carries_load() const { return group() == Group::damper; }
  // Its force is the acceleration of the base under the damper (a tyre's), no load.
  virtual bool moves_base() const { return false; }
  // Non-null for what changes the measurement rather than the motion.
  virtual const Instrument* instrument() const { return nullptr; }
  // It stands between the damper and the mass: all loads are carried through it.
  virtual bool in_series() const { return false; }

  // Adds the effect at `at`. `theta` holds the own parameters, then the borrowed ones. Returns
  // false, leaving the output unspecified, when a point is inadmissible (1 - theta3 u <= 0).
  // Neither allocates nor throws.
  virtual bool evaluate(const Points& at, const double* theta, const double* constants,
                        const Forces& out) const = 0;

  // The same for eight models abreast: point i is of lane i % 8, parameter k of lane l is
  // theta[8 k + l], at.n a multiple of 8. Returns a bit for each lane that is admissible
  // throughout. For effects without internal coordinates that do not see the excitation. This one
  // takes the lanes apart and calls `evaluate`; effects of the hot loop have their own.
  virtual unsigned evaluate_lanes(const Points& at, const double* theta, const double* constants,
                                  const Forces& out) const;

  virtual bool has_velocity_kink() const { return false; }
  // The jump of the second derivative of the force over v, at v = 0 and stroke u: what |v| v has
  // and what limits every fixed grid to third order. 0 for a smooth effect.
  virtual double velocity_kink(const double* /*theta*/, const double* /*constants*/,
                               double /*u*/) const {
    return 0.0;
  }
};

}  // namespace shaker::estimator
