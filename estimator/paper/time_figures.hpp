// The paper's identifications by time integration, run again: Verbeek (1991), sections 6 and 6.1,
// figures 5, 6, 7, 9 and 10.
//
// 6 and 7 (free decay of the linear oscillator (6.2), 5 points) come out of the estimator that is
// shipped, digit by digit. 9 and 10 (free decay of the oleo) come out only with the factor 2 that
// the paper's program lost, see slipped_program.hpp. 5 (5 points within a sixtieth of a cycle) does
// not come out: its printed values are noise, and what follows depends on how a diverged
// integration overflowed.
#pragma once

#include "estimator/paper/figures.hpp"

namespace shaker::estimator::paper {

inline const std::vector<int> kTimeFigures = {5, 6, 7, 9, 10};

// Iterates are initial displacement and velocity, then theta. Throws std::invalid_argument for
// other figures.
FigureRun reproduce_time(int figure);

// Figure 9's record fitted with the derivative as it should be.
std::vector<std::vector<double>> figure_nine_without_the_slip();

}  // namespace shaker::estimator::paper
