// Runs beside each other, and beside their model, before a fit.
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

}  // namespace shaker::estimator
