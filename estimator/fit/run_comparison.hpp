// Runs and campaigns beside each other, and beside their model.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

// Weights each run by its own noise variance, from the scatter of its cycles (3.15). Returns the
// first run whose cycles do not determine it; then no weight changes.
std::optional<std::size_t> weigh_by_scatter(std::vector<RunData>& runs);

// For an estimate that is not usable: returns a sentence when data and model seem to have
// different units, otherwise empty.
std::string unit_doubt(const Model& model, const RunData& run);

// The largest speed and stroke of the periodic solutions of a fit, in the model's units.
struct MotionOfRuns {
  double fastest = 0.0, deepest = 0.0;
};
MotionOfRuns motion_of_runs(const Estimator& fitted, const Model& model);

// A free parameter that the data determine, by one campaign alone.
struct ParameterAlone {
  std::string name;
  double value = 0.0, standard_error = 0.0;
};
// Empty where the runs have no estimate. Throws std::invalid_argument for runs that cannot be used.
std::vector<ParameterAlone> estimated_alone(const Model& model, std::vector<RunData> runs);

// The parameter in which two campaigns differ most, by more than noise explains: its index. Nothing
// where they agree, or have not the same parameters. Pure.
std::optional<std::size_t> disagreement(const std::vector<ParameterAlone>& one,
                                        const std::vector<ParameterAlone>& other);

}  // namespace shaker::estimator
