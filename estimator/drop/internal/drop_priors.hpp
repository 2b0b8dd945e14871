// What a shaker does not test and a drop needs: the discharge coefficient of the orifice beyond the
// tested velocities, and the polytropic index of the gas at the drop's rate. Each is a normal prior
// that widens the band; without one the laws of the effects are taken to go on as they were. What
// differed from run to run of the campaign differs in the drop too.
#pragma once

#include <vector>

#include "estimator/drop/drop.hpp"
#include "estimator/drop/unnamed_force.hpp"
#include "estimator/model/identified_damper.hpp"

namespace shaker::estimator {

struct ExtrapolationPriors {
  // Relative standard deviation of C_d for each decade of the Reynolds number beyond the largest
  // tested velocity; 0: C_d stays. The orifice's force goes with 1 / C_d^2.
  double discharge_spread = 0.0;
  double index_spread = 0.0;  // standard deviation of the polytropic index; 0: it stays
  RunSpread runs = {};        // of the damper that falls
  bool any() const { return discharge_spread > 0.0 || index_spread > 0.0 || runs.any(); }
};

// The forces that one standard deviation of each prior adds along the drop of the hypothesis, at the
// times `t`. `tested_speed`: the largest that the campaign visited. No modes where the drop fails or
// the model has no such effect.
ForceAlongPath prior_forces(const DamperHypothesis& damper, const DropConditions& conditions,
                            const ExtrapolationPriors& priors, double tested_speed,
                            const std::vector<double>& t);

// The force of the orifices where the drop leaves the knots of a table that ends there (`ended`):
// its one standard deviation is what the area changes over the whole table, at most kMostBeyond of
// the force. No mode where the drop fails or no orifice acts.
inline constexpr double kMostBeyond = 0.45;
ForceAlongPath beyond_table(const DamperHypothesis& ended, const config::PinTable& table,
                            double fall, const DropConditions& conditions,
                            const std::vector<double>& t);

}  // namespace shaker::estimator
