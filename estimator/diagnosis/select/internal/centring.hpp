// The rest position of an added force. It is a constant of the effect's line; it is fitted and
// reported like a parameter.
#pragma once

#include <cstddef>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/select/internal/hypothesis.hpp"

namespace shaker::estimator::diagnosis {

// Indices of the added lines whose rest position is fitted.
std::vector<std::size_t> fitted_places(const config::ModelSpec& spec, std::size_t first_added);

// The rest positions with their standard errors, and how they move the parameters. A position that
// the data do not determine is left out.
std::vector<FittedConstant> places_of(const Hypothesis& h, const std::vector<RunDatum>& data,
                                      std::size_t first_added);

}  // namespace shaker::estimator::diagnosis
