// One term of the plant's balance of accelerations.
//
//     u'' + sum of the parts' forces + direction * friction = x(t)
//
// Forces are per unit mass (m/s^2) and positive when they oppose compression; u > 0 is
// compression. During one integration step the direction of motion is constant, because the
// integrator stops where v = 0. A part uses `direction` where a formula has sign(v); its force
// is therefore smooth.
//
// A part is one file in sim/parts/ and one row of the table in sim/parts/table.cpp.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace shaker::sim {

// u, v, then the memory states of parts that have them (gas temperature, hysteretic
// displacement).
inline constexpr int kStates = 8;
using State = std::array<double, kStates>;

struct Motion {
  double u = 0.0, v = 0.0;
  double direction = 0.0;  // +1, -1, or 0 when stuck (then v = 0)
  const State& state;

  double speed() const { return direction * v; }  // |v|
};

// The sums over the parts, in the order of the plant's list.
struct Balance {
  double force = 0.0;     // all forces that are smooth while the direction is constant
  double gas = 0.0;       // the gas spring's part of `force`, for pressure friction
  double friction = 0.0;  // magnitude of dry friction; the break-away level when stuck
  double mass = 1.0;      // the relative mass that u'' accelerates
};

struct Parameter {
  std::string_view name, unit;
  double standard;         // default
  double lowest, highest;  // allowed range
  std::string_view meaning;
};

// Values by name; complete and within their ranges.
using Values = std::map<std::string, double>;

// Assigns memory states to parts. Throws std::logic_error when kStates is too small.
class Memory {
 public:
  int claim(double initial);
  const State& initial() const { return initial_; }

 private:
  State initial_{};
  int next_ = 2;
};

class PlantPart {
 public:
  virtual ~PlantPart() = default;
  // Adds the part's terms to `balance`.
  virtual void add(const Motion& motion, Balance& balance) const = 0;
  // Sets the time derivatives of the part's own memory states.
  virtual void remember(const Motion&, State&) const {}
  // For a part between the damper and the table, for example a tyre: sets the derivatives of
  // its own motion and returns the acceleration by which it sinks, m/s^2. `force` is the
  // damper's whole force minus the weight g; x is the table's acceleration.
  virtual double support(const Motion&, double /*force*/, double /*x*/, State&) const {
    return 0.0;
  }
};

struct PartEntry {
  std::string_view name;
  std::span<const Parameter> parameters;
  // Returns null when the values switch the part off.
  std::unique_ptr<PlantPart> (*make)(const Values& values, Memory& memory);
};

// All parts that exist (sim/parts/table.cpp).
std::span<const PartEntry> part_table();

}  // namespace shaker::sim
