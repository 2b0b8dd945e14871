// The plant carried forward in time by Boost.Odeint (Dormand-Prince 5, adaptive, 1e-12).
//
// Dry friction and |v| v have a corner at v = 0. The integrator does not step over it: it finds the
// instant at which the velocity vanishes, stops there and decides whether the damper goes on, turns
// or sticks (it sticks while the other forces stay below the break-away level), so friction is the
// sharp sign(v) and nothing is smoothed. The wall at which the gas column is used up is met without
// bouncing: the velocity becomes zero there and `bottomed` is raised.
#pragma once

#include <memory>

#include "sim/plant.hpp"
#include "sim/table_motion.hpp"

namespace shaker::sim {

class Integrator {
 public:
  // `plant` must outlive it.
  Integrator(const Plant& plant, const State& start, double t);
  ~Integrator();

  // Integrates to `until` (s); earlier times do nothing.
  void advance(double until, const TableMotion& table);
  // The table's motion was changed: what was known of its past says nothing any more.
  void table_changed();

  const State& state() const;
  double time() const;
  double acceleration(const TableMotion& table) const;  // u''
  bool stuck() const;
  // Whether the wall was met, or the state ceased to be finite, since the last call.
  bool take_bottomed();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::sim
