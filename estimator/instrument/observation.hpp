// What is measured: a channel is a quantity of the motion, seen through its instruments.
//
// An Observation turns motion into the channel's number and gives its exact partial derivatives
// over the motion, the excitation and the parameters, pointwise; `PeriodicSystem::observed` and
// `observed_row` chain them with the solution's own sensitivities. Time integration uses
// `motion()` directly along its trajectory.
//
// The instrument effects of a model stand in the way of its displacement channel; other channels
// are taken as perfect.
#pragma once

#include <string_view>

#include "estimator/model.hpp"

namespace shaker::estimator {

enum class Quantity {
  displacement,           // u of the model's observed coordinate, m
  velocity,               // its rate, m/s
  acceleration,           // its second derivative (mass against table), m/s^2
  absolute_acceleration,  // of the mass, as an accelerometer on it shows: x minus the above
  damper_force,           // load between damper and mass, per unit mass: a load cell's, m/s^2
};

constexpr std::string_view name(Quantity quantity) {
  constexpr std::string_view names[] = {"displacement", "velocity", "acceleration",
                                        "absolute_acceleration", "damper_force"};
  return names[static_cast<int>(quantity)];
}

// At n points: y = the quantity, and its partial derivatives. y_u, y_v, y_a have an array a
// coordinate, y_theta one a parameter; all are overwritten.
struct ObservedMotion {
  double* y = nullptr;
  double* const* y_u = nullptr;
  double* const* y_v = nullptr;
  double* const* y_a = nullptr;
  double* const* y_theta = nullptr;
};

// The quantity itself, before instruments. `workspace`: observation_arrays() arrays of n points.
// False when a point is inadmissible. Neither allocates nor throws.
int observation_arrays(const Model& model);
bool observe_motion(const Model& model, Quantity quantity, const ModelPoints& at,
                    const double* theta, const ObservedMotion& out, double* const* workspace);

}  // namespace shaker::estimator
