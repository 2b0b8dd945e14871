// Labels and units of the figures of a drop.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "estimator/drop/drop.hpp"

namespace shaker::cli {

using estimator::figure_called;

// `figure`: an index of estimator::kDropFigures. `length`: the model's length unit. `newton`: the
// mass is known, so that loads are in N and energies in J; else both are per mass.
std::string figure_unit(std::size_t figure, const std::string& length, bool newton);
std::string figure_label(std::size_t figure, bool newton);

// Whether a figure belongs to a gear with a tyre.
bool is_gear_figure(std::size_t figure);

// Whether nobody asks for a figure where it has no value: those of a tyre, and the margin.
bool may_be_absent(std::size_t figure);

inline constexpr std::string_view kMarginFigure = "margin_to_bottoming";

}  // namespace shaker::cli
