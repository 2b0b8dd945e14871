// The quantities of the motion that a channel can measure.
//
// observe_motion computes a quantity from the motion, with exact partial derivatives over
// motion and parameters, point by point. `PeriodicSystem::observed` and `observed_row` combine
// them with the sensitivities of the solution.
//
// The instrument effects of a model act on its displacement channel only. Other channels are
// treated as perfect.
#pragma once

#include <string_view>

#include "estimator/model/model.hpp"

namespace shaker::estimator {

enum class Quantity {
  displacement,           // u of the model's observed coordinate, m
  velocity,               // its first derivative, m/s
  acceleration,           // its second derivative (mass relative to table), m/s^2
  absolute_acceleration,  // of the mass, as an accelerometer on it measures, m/s^2
  damper_force,           // load between damper and mass per unit mass (a load cell), m/s^2
};

constexpr std::string_view name(Quantity quantity) {
  constexpr std::string_view names[] = {"displacement", "velocity", "acceleration",
                                        "absolute_acceleration", "damper_force"};
  return names[static_cast<int>(quantity)];
}

// A quantity y at n points and its partial derivatives. y_u, y_v, y_a: one array a coordinate;
// y_theta: one array a parameter. observe_motion overwrites all of them.
struct ObservedMotion {
  double* y = nullptr;
  double* const* y_u = nullptr;
  double* const* y_v = nullptr;
  double* const* y_a = nullptr;
  double* const* y_theta = nullptr;
};

// Computes a quantity before the instruments. `workspace`: observation_arrays() arrays of n
// values. Returns false if a point is inadmissible. Neither allocates nor throws.
int observation_arrays(const Model& model);
bool observe_motion(const Model& model, Quantity quantity, const ModelPoints& at,
                    const double* theta, const ObservedMotion& out, double* const* workspace);

}  // namespace shaker::estimator
