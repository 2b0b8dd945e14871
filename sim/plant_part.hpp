// One term of the plant's balance of accelerations, in the simulator's own words.
//
//     u'' + sum of the parts' forces + direction * friction = x(t)
//
// Forces are per unit mass (m/s^2), positive when they oppose compression; u > 0 is compression.
// Within one integration the sense of motion is a given (the integrator finds the instants at which
// v = 0 and changes it there), so a part uses `direction` where a formula has sign(v), and is
// smooth.
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

// u, v, then the memory of parts that have some (gas temperature, hysteretic displacement).
inline constexpr int kStates = 8;
using State = std::array<double, kStates>;

struct Motion {
  double u = 0.0, v = 0.0;
  double direction = 0.0;  // +1, -1, or 0 when stuck (then v = 0)
  const State& state;

  double speed() const { return direction * v; }  // |v|
};

// What the parts add up to, in the order of the plant's list.
struct Balance {
  double force = 0.0;     // all that is smooth in the direction of motion
  double gas = 0.0;       // of which the gas spring's (pressure friction wants it)
  double friction = 0.0;  // magnitude of dry friction; break-away level when stuck
  double mass = 1.0;      // that u'' moves
};

struct Parameter {
  std::string_view name, unit;
  double standard;         // default
  double lowest, highest;  // allowed
  std::string_view meaning;
};

// Values by name, complete and checked.
using Values = std::map<std::string, double>;

// Hands out memory states. Throws std::logic_error when kStates is too small.
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
  virtual void add(const Motion& motion, Balance& balance) const = 0;
  // Time derivatives of the part's own memory.
  virtual void remember(const Motion&, State&) const {}
  // What the damper stands on, if it gives: sets the derivatives of its own motion under the forces
  // of the damper (without the weight: `force` holds -g) and of the table, and returns the
  // acceleration by which it sinks.
  virtual double support(const Motion&, double /*force*/, double /*x*/, State&) const {
    return 0.0;
  }
};

struct PartEntry {
  std::string_view name;
  std::span<const Parameter> parameters;
  // Null when the values switch the part off.
  std::unique_ptr<PlantPart> (*make)(const Values& values, Memory& memory);
};

// Every part there is (sim/parts/table.cpp).
std::span<const PartEntry> part_table();

}  // namespace shaker::sim
