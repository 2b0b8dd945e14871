// The force that no hypothesis names: a smooth random function of stroke and velocity.
//
// A Gaussian process with mean 0 (C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for
// Machine Learning (2006), ch. 2). Where the campaign was, it is held to what the campaign left
// there. Away from there it widens: with the square of the velocity, as the forces of oil do, and
// in proportion to the distance in stroke. A part of it may jump where the velocity reverses, as
// friction does.
//
// A named effect may only imitate the force where the campaign was. Beyond, the force then goes on as
// it likes, and not as the name does: it widens by as much as a force of the whole gap's size would
// change that is linear in the stroke.
//
// What the campaign left is what no parameter could take. The parameters were fitted without the
// force, and have taken the rest of it: so much that force and parameters together are what was
// measured. Therefore each possible force has parameters of its own.
#pragma once

#include <vector>

#include "estimator/model/identified_damper.hpp"

namespace shaker::estimator {

// Standard deviations of the force where the campaign was, m/s^2.
struct UnnamedSize {
  double least = 0.0;  // at least
  double taken = 0.0;  // of the whole gap, of which names take a part that they may only imitate
};

struct ForceAlongPath {
  std::vector<double> mean;                // at the points of the path, m/s^2
  std::vector<std::vector<double>> modes;  // independent, each times a standard normal variate
  // How far the damper's numbers are from the estimates with it, and a list more with each mode.
  // Empty: not at all.
  std::vector<double> mean_shift;
  std::vector<std::vector<double>> shifts;
};

// The force along a path of strokes (m) and velocities (m/s), at most `most` modes that together
// hold all but `left` of its variance. `cells`: where the campaign was, with what is left there;
// empty where there are none. `bent`: the damper whose numbers it has bent; null: none.
ForceAlongPath unnamed_force_along(const std::vector<VisitedCell>& cells,
                                   const UnnamedSize& size_there, const std::vector<double>& stroke,
                                   const std::vector<double>& velocity,
                                   const DamperHypothesis* bent = nullptr, std::size_t most = 10,
                                   double left = 1e-3);

// Of the forces in the cells, m/s^2; 0 where there are none.
double root_mean_square(const std::vector<VisitedCell>& cells);

// Whether a point lies within the hull of what was visited.
class VisitedRegion {
 public:
  explicit VisitedRegion(const std::vector<VisitedCell>& cells);
  bool holds(double stroke, double velocity) const;
  bool empty() const { return hull_.size() < 3; }

 private:
  std::vector<VisitedCell> hull_;  // convex, counter-clockwise
};

}  // namespace shaker::estimator
