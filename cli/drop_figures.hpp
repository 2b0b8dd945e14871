// Labels and units of the figures of a drop.
#pragma once

#include <cstddef>
#include <string>

namespace shaker::cli {

// `figure`: an index of estimator::kDropFigures. `length`: the model's length unit. `newton`: the
// mass is known, so that loads are in N and energies in J; else both are per mass.
std::string figure_unit(std::size_t figure, const std::string& length, bool newton);
std::string figure_label(std::size_t figure, bool newton);

}  // namespace shaker::cli
