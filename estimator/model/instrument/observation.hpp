/// \file
/// The quantities of the motion that a channel can measure.
///
/// observe_motion computes a quantity from the motion, with exact partial derivatives over
/// motion and parameters, point by point. `PeriodicSystem::observed` and `observed_row` combine
/// them with the sensitivities of the solution.
///
/// The instrument effects of a model act on its displacement channel only. Other channels are
/// treated as perfect.
#pragma once

#include <string_view>

#include "estimator/model/model.hpp"

namespace shaker::estimator {

/// A measured quantity. A model in another length unit replaces the metre.
enum class Quantity {
  displacement,           ///< u of the model's observed coordinate, m
  velocity,               ///< its first derivative, m/s
  acceleration,           ///< its second derivative (mass relative to table), m/s^2
  absolute_acceleration,  ///< of the mass, as an accelerometer on it measures, m/s^2
  damper_force,           ///< load between damper and mass per unit mass (a load cell), m/s^2
};

/// \param quantity a quantity
/// \return its word in documents
constexpr std::string_view name(Quantity quantity) {
  constexpr std::string_view names[] = {"displacement", "velocity", "acceleration",
                                        "absolute_acceleration", "damper_force"};
  return names[static_cast<int>(quantity)];
}

/// A quantity y at n points and its partial derivatives. y_u, y_v, y_a: one array a coordinate;
/// y_theta: one array a parameter. observe_motion overwrites all of them.
struct ObservedMotion {
  double* y = nullptr;               ///< n values
  double* const* y_u = nullptr;      ///< over each coordinate
  double* const* y_v = nullptr;      ///< over each velocity
  double* const* y_a = nullptr;      ///< over each acceleration
  double* const* y_theta = nullptr;  ///< over each parameter
};

/// \param model the model
/// \return the number of arrays that `workspace` must hold
int observation_arrays(const Model& model);
/// Computes a quantity before the instruments. Neither allocates nor throws.
/// \param model the model
/// \param quantity what to compute
/// \param at n points
/// \param theta all parameters
/// \param out receives the quantity and its derivatives
/// \param workspace observation_arrays() arrays of n values
/// \return false if a point is inadmissible
bool observe_motion(const Model& model, Quantity quantity, const ModelPoints& at,
                    const double* theta, const ObservedMotion& out, double* const* workspace);

}  // namespace shaker::estimator
