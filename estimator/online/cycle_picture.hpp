/// \file
/// What the fitted model says of one measured cycle, for people to look at.
#pragma once

#include <vector>

#include "estimator/model/model.hpp"
#include "estimator/online/measured_cycle.hpp"

namespace shaker::estimator {

/// Both vectors have the points of the measured cycle.
struct CyclePicture {
  /// The model's stroke at the last estimate, in the model's length unit, under the mean
  /// excitation of the cycle's run. Empty: there is no estimate yet.
  std::vector<double> response;
  /// Force on the sprung mass over the reference mass, m/s^2, that the model lacks for the
  /// measured motion. Empty where online::missing_force cannot compute it.
  std::vector<double> missing_force;
};

namespace online {

/// Harmonics of the measured stroke that are differentiated. Higher ones carry mostly noise.
inline constexpr int kMotionHarmonics = 8;

/// Takes the measured stroke and its derivatives as the motion and returns what is left of the
/// equation of motion (5.1), with the opposite sign: a term that, added to the model's forces,
/// would make the motion a solution. Stroke and derivatives are those of the first
/// kMotionHarmonics harmonics. Empty for a model of several coordinates, with an instrument or
/// with memory, for too few points, and where the motion is inadmissible.
/// \param model the model
/// \param theta all parameters, in the model's order and units
/// \param cycle the measured period
/// \return one force for each point of the cycle, m/s^2
std::vector<double> missing_force(const Model& model, const std::vector<double>& theta,
                                  const MeasuredCycle& cycle);

}  // namespace online
}  // namespace shaker::estimator
