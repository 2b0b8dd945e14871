// Integrates the plant in time with Boost.Odeint (Dormand-Prince 5, adaptive, tolerance 1e-12).
//
// Dry friction and |v| v are not smooth at v = 0. The integrator does not step over this point.
// It finds the instant at which the velocity vanishes, stops there and decides whether the
// damper continues, reverses or sticks; it sticks while the other forces stay below the
// break-away level. Friction is therefore the exact sign(v), without smoothing. At the wall,
// where the gas column is used up, the damper does not bounce: its velocity becomes zero and
// the `bottomed` flag is set.
#pragma once

#include <memory>

#include "sim/plant.hpp"
#include "sim/table_motion.hpp"

namespace shaker::sim {

class Integrator {
 public:
  // `plant` must outlive the integrator. `t` is the start time, s.
  Integrator(const Plant& plant, const State& start, double t);
  ~Integrator();

  // Integrates to the time `until`, s. Does nothing when `until` is not after time().
  void advance(double until, const TableMotion& table);
  // Must be called when the motion of the table has changed: it discards the stored derivative.
  void table_changed();

  const State& state() const;
  double time() const;
  double acceleration(const TableMotion& table) const;  // u''
  bool stuck() const;
  // Returns whether the wall was met or the state became non-finite since the last call, and
  // clears the flag. After a non-finite state the damper is at rest again.
  bool take_bottomed();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::sim
