// A damper, its instruments and its table, written from the text of the catalogue alone. Nothing of
// `sim/` or `estimator/` is used: dry friction sticks, and no corner is rounded.
#pragma once

#include <array>
#include <map>
#include <string>

namespace shaker::dirty {

inline constexpr double kGravity = 9.80665;  // m/s^2

// What one campaign is of. An effect is there when its name is a key; the values are its parameters
// in SI units, accelerations for forces.
using Effects = std::map<std::string, std::map<std::string, double>>;

// Dry friction, as what it may reach: it takes the sign of the velocity, or holds.
struct DryFriction {
  double slipping = 0.0;  // m/s^2
  double holding = 0.0;   // m/s^2
};

// Internal states, in this order. kStroke and kVelocity are those of the damper's piston.
enum StateIndex {
  kStroke,
  kVelocity,
  kDahl,       // m, bristle of presliding_friction
  kBoucWen,    // m, hysteresis
  kOil,        // m, compression of the oil
  kHeat,       // temperature over that at rest
  kDissolved,  // gas that is not dissolved, over that at rest
  kInner,      // m, stroke behind a free play
  kTyre,       // m, deflection of the tyre
  kTyreRate,   // m/s
  kLagged,     // m, output of a slow sensor
  kBush,       // m, dashpot of the unknown `maxwell_bush`
  kWarmth,     // of the unknown `fading_oil`, 1 for a halved damping
  kAppendage,  // m, the unknown `appendage`
  kAppendageRate,
  kStates
};
using State = std::array<double, kStates>;

// What differs from run to run.
struct RunChange {
  double zero = 0.0;         // m, or m/s^2 of a load cell
  double preload = 0.0;      // m/s^2
  double temperature = 0.0;  // relative change of the gas pressure, or of the oil's viscosity
};

// Every number of a device. What is not hidden keeps a value with which it does nothing.
struct Numbers {
  double theta1 = 0.0, theta2 = 0.0, theta3 = 0.0, theta4 = 1.0;  // the oleo
  double c = 0.0, k = 0.0;                                        // the linear oscillator
  double coulomb = 0.0, pressed = 0.0;
  double peak_f = 0.0, peak_ratio = 1.0, peak_v = 1.0;
  double dahl_f = 0.0, dahl_z0 = 1.0;
  double wen_k = 0.0, wen_b = 0.0, wen_c = 0.0, wen_n = 1.0;
  double viscous = 0.0, drag = 0.0, laminar_v = 0.0, rebound = 1.0, pin1 = 0.0, pin2 = 0.0;
  double relief_f = 1e9, relief_k = 1.0, cavitation_f = 1e9, oil_k = 0.0, oil_leak = 0.0;
  double heat_tau = 0.0, solubility = 0.0, solution_tau = 0.0, real = 0.0;
  double second_share = 0.0, second_u = 0.0;
  double stop_k = 0.0, stop_d = 0.0, stop_u = 0.0, play = 0.0, play_k = 0.0;
  double spring_k = 0.0, spring_u0 = 0.0, cubic_k = 0.0, cubic_u0 = 0.0;
  double added_mass = 0.0, joint_k = 0.0, tyre_r = 0.0, tyre_k = 0.0, tyre_c = 0.0;
  double gain = 1.0, bend2 = 0.0, bend3 = 0.0, lag = 0.0, drift = 0.0;
  double cogging = 0.0, cogging_length = 1.0, cogging_u = 0.0;  // from here on: in no catalogue
  double tilt = 0.0, tilt_u = 0.0, bush = 0.0, bush_tau = 1.0;
  double fading = 0.0, fading_tau = 1.0;
  double appendage = 0.0, appendage_omega = 1.0, appendage_damping = 0.0;
};

class Device {
 public:
  // `base`: theta1..theta4 of the oleo, or c and k of the linear oscillator. `weight`: gravity acts.
  // Throws std::invalid_argument for a parameter that no device has.
  Device(const std::map<std::string, double>& base, const Effects& effects, bool weight);

  // The stroke at which the device rests, m.
  double rest() const;
  // The state at rest at this stroke.
  State at_rest(double stroke) const;
  // Force per unit mass but for dry friction and added mass. Fills `rate` for the internal states
  // of the damper.
  double force(const State& s, const RunChange& run, State& rate) const;
  DryFriction dry(const State& s, const RunChange& run) const;
  // Acceleration of the stroke under `excitation` and the dry force `dry`, m/s^2. Fills `rate`.
  double acceleration(const State& s, double excitation, double dry, const RunChange& run,
                      State& rate) const;
  // By how much a unit of dry force decelerates the stroke.
  double mobility() const;
  // What the displacement sensor shows, without noise; `load`: of the damper, m/s^2.
  double shown(const State& s, double load, double t, const RunChange& run) const;
  double added_mass() const { return n_.added_mass; }
  bool has_dry_friction() const;

 private:
  double pressure(double u, const RunChange& run) const;
  double gas(const State& s, const RunChange& run, State& rate) const;
  double orifice(double u, double v, double scale) const;
  double oil(const State& s, double scale, State& rate) const;
  double linear(const State& s, const RunChange& run, State& rate) const;
  double beside(const State& s, State& rate) const;
  double memory(const State& s, State& rate) const;
  double unknown(const State& s, State& rate) const;

  Numbers n_;
  bool oleo_;
  bool weight_;
};

}  // namespace shaker::dirty
