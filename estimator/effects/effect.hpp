// An effect: one physical mechanism of a model, with a name, its parameters, its force and the
// exact partial derivatives of the force.
//
// A model is a sum of effects written as accelerations on the left of (6.3),
//     u'' + sum of effects = x(t),
// so that an effect's "force" is per unit mass, m/s^2. An effect sees one local coordinate: stroke
// u, velocity v, acceleration a, at many points at once (arrays), because the loops over the points
// are where the time of an estimate goes.
//
// Adding one: effects/README.md.
#pragma once

#include <span>
#include <string_view>

namespace shaker::estimator {

struct ParameterInfo {
  std::string_view symbol;  // "theta1"
  std::string_view unit;    // in SI: "1/m"; models in feet relabel the metre
  double start;             // where to begin when nothing is said
  double lower, upper;      // physically admissible
  std::string_view meaning;
};

struct ConstantInfo {
  std::string_view symbol, unit;
  double value;
  std::string_view meaning;
};

// n points of one coordinate. Arrays are 64-byte aligned and readable up to the next multiple of 8.
struct Points {
  int n = 0;
  const double* u = nullptr;
  const double* v = nullptr;
  const double* a = nullptr;
};

// The force and its partial derivatives at the points. `evaluate` adds to the first four and
// overwrites the parameter columns.
struct Forces {
  double* f = nullptr;
  double* f_u = nullptr;
  double* f_v = nullptr;
  double* f_a = nullptr;
  double* const* f_theta = nullptr;  // one array a parameter
};

// Immutable; one object serves all threads.
class Effect {
 public:
  virtual ~Effect() = default;
  virtual std::string_view name() const = 0;
  virtual std::string_view formula() const = 0;  // for people: "theta1 |v| v"
  virtual std::span<const ParameterInfo> parameters() const { return {}; }
  virtual std::span<const ConstantInfo> constants() const { return {}; }

  // Adds the effect at `at`. Returns false, leaving the output unspecified, when a point is
  // inadmissible (1 - theta3 u <= 0). Neither allocates nor throws.
  virtual bool evaluate(const Points& at, const double* theta, const double* constants,
                        const Forces& out) const = 0;

  // The jump of the second derivative of the force over v, at v = 0: what |v| v has and what limits
  // every fixed grid to third order. 0 for a smooth effect.
  virtual double velocity_kink(const double* /*theta*/, const double* /*constants*/) const {
    return 0.0;
  }
};

}  // namespace shaker::estimator
