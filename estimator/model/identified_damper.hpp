/// \file
/// What a shaker campaign says of a damper, as a prediction needs it: the hypotheses that the
/// campaign does not exclude, each with its estimate and probability; what of the motion was
/// visited; and the force that no hypothesis names.
///
/// Plain data: a diagnosis fills it (estimator/diagnosis/report/internal/hypotheses.hpp), report/ writes
/// and reads it, a drop starts from it (drop_mixture.hpp). Forces are per reference mass.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "config/model.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator {

/// A number of a model file: a parameter's start or a constant (the place of rest of a spring) of
/// one line of its effects.
struct ModelNumber {
  std::size_t line = 0;   ///< index in ModelSpec::effects
  std::string symbol;     ///< of the parameter or constant
  bool constant = false;  ///< true: a constant
};

/// A cell of stroke and velocity where the campaign has been: the means over the motion in it.
/// `force` and its standard error are what is not explained there (0 and 0 where that was not
/// estimated).
struct VisitedCell {
  /// Middle of the cell: length unit and length unit per s.
  /// @{
  double stroke = 0.0, velocity = 0.0;
  /// @}
  /// Force and its standard error, m/s^2.
  /// @{
  double force = 0.0, standard_error = 0.0;
  /// @}
};

/// One possible damper: the base model with some effects added.
struct DamperHypothesis {
  std::vector<std::string> effects;  ///< added to the base model; sorted; empty: the base model
  double probability = 0.0;          ///< of all hypotheses together 1
  config::ModelSpec model;           ///< starts at the estimates
  std::vector<ModelNumber> numbers;  ///< the uncertain ones
  std::vector<double> covariance;    ///< numbers x numbers, row by row
  double degrees_of_freedom = 0.0;   ///< behind the covariance
  /// The force that this hypothesis leaves, where something is left for certain; empty: not known.
  std::vector<VisitedCell> left;
};

/// What differs from run to run of one damper without an effect that is missing: standard
/// deviations.
struct RunSpread {
  double force = 0.0;         ///< of a constant force, m/s^2
  double gas_pressure = 0.0;  ///< relative
  double damping = 0.0;       ///< relative, of the viscous damping
  /// \return true if anything differs
  bool any() const { return force > 0.0 || gas_pressure > 0.0 || damping > 0.0; }
};

/// All that a campaign says of a damper.
struct IdentifiedDamper {
  /// Name of the campaign, and the diagnosis' verdict in a word.
  /// @{
  std::string campaign, verdict;
  /// @}
  /// What identifies the diagnosed data: a hash of them, and the specimen that they name, as
  /// "serial SN-42". Empty where it is not known.
  /// @{
  std::string data, specimen;
  /// @}
  std::vector<DamperHypothesis> hypotheses;  ///< the first is the answer of the diagnosis
  std::vector<VisitedCell> visited;          ///< the cells, in no order
  /// Probability that a force acts which no hypothesis names, and the standard deviation of that
  /// force where the campaign was, m/s^2.
  /// @{
  double unnamed_probability = 0.0, unnamed_force = 0.0;
  /// @}
  RunSpread spread;  ///< a drop is one more run
};

/// The place of each parameter in the model file from which the model was made.
/// \param model the model
/// \return one place for each parameter, in the order of theta; values of one parameter per run or
///   group have one place
std::vector<ModelNumber> numbers_of(const Model& model);

/// The value of a number.
/// \param spec the model file's content
/// \param number which number
/// \return the value, in the model's unit
double value_of(const config::ModelSpec& spec, const ModelNumber& number);
/// Changes a number.
/// \param spec the model file's content to change
/// \param number which number
/// \param value the new value, in the model's unit
void set_value(config::ModelSpec& spec, const ModelNumber& number, double value);

/// The damper without the effects of sensors and exciter, which stay on the shaker. Their numbers
/// leave the covariance, which is that of the remaining numbers whatever the left ones are.
/// \param hypothesis the damper on the shaker
/// \return the damper alone
DamperHypothesis without_instruments(const DamperHypothesis& hypothesis);

/// The hypothesis with the numbers that stand near a bound fixed there, and the others and their
/// covariance given that. Its probability is half of the whole where a number stands at its bound,
/// and less by the normal density farther away. Nothing where none is near,
/// or where that takes another out of its bounds.
/// \param hypothesis the damper
/// \return the damper with those numbers held, or nothing
std::optional<DamperHypothesis> held_at_bounds(const DamperHypothesis& hypothesis);

}  // namespace shaker::estimator
