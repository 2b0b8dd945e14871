// From the damper on the shaker to the damper that falls: another mass on it, and a tyre below it.
//
// A model counts forces over the mass that the damper carried on the shaker. A drop counts them over
// the mass that falls, so that the loads of both are the same in N.
#pragma once

#include <vector>

#include "config/model.hpp"
#include "estimator/model/identified_damper.hpp"

namespace shaker::estimator {

// What a line of a model's effects is in a drop: a load of the damper, a mass or a spring of its own
// under it, weight, or something of the shaker.
enum class LineKind { load, base, weight, shaker };
std::vector<LineKind> line_kinds(const config::ModelSpec& spec);

// A tyre and the unsprung mass on it.
struct FallingTyre {
  double stiffness = 0.0;      // N/m
  double damping = 0.0;        // N s/m
  double unsprung_mass = 0.0;  // kg
};

// The sum of the masses of a model below the damper, over the reference mass.
double unsprung_share(const config::ModelSpec& spec);

// The model with `ratio` times the mass on its damper. Forces are over the new mass. Throws
// std::invalid_argument where an equation below the first contains the mass on the damper.
config::ModelSpec with_mass(config::ModelSpec spec, double ratio);
// The same with the covariance of the estimates.
DamperHypothesis with_mass(DamperHypothesis hypothesis, double ratio);
// With the force that no hypothesis names, too. The effects of the shaker are left behind.
IdentifiedDamper with_mass(const IdentifiedDamper& damper, double ratio);

// The model on a tyre. `sprung`: the mass above the damper, kg. Throws std::invalid_argument for a
// model with a tyre or with coordinates of its own, and for masses or a stiffness not above 0.
config::ModelSpec on_tyre(config::ModelSpec spec, const FallingTyre& tyre, double sprung);

}  // namespace shaker::estimator
