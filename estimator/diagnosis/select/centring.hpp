// The place of rest of a force that was added: a constant of its line, fitted like a parameter, and
// told like one.
#pragma once

#include <cstddef>
#include <vector>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"
#include "estimator/diagnosis/select/hypothesis.hpp"

namespace shaker::estimator::diagnosis {

// The lines behind the base model's whose place of rest is fitted.
std::vector<std::size_t> fitted_places(const config::ModelSpec& spec, std::size_t first_added);

// Each with its standard error, all parameters following, and what it bends them by. One that the
// data do not show is left out.
std::vector<FittedConstant> places_of(const Hypothesis& h, const std::vector<RunDatum>& data,
                                      std::size_t first_added);

}  // namespace shaker::estimator::diagnosis
