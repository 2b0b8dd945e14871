// Reproduction of the paper's identifications by time integration: Verbeek (1991), sections 6 and
// 6.1, figures 5, 6, 7, 9 and 10.
//
// TransientEstimator reproduces all digits of figures 6 and 7 (free decay of the linear oscillator
// (6.2), 5 points). Figures 9 and 10 (free decay of the oleo) can be reproduced only with the
// missing factor 2 of the paper's program, see slipped_program.hpp. Figure 5 (5 points within a
// sixtieth of a cycle) cannot be reproduced: its printed values are noise, and the later ones
// depend on how a diverged integration overflowed.
#pragma once

#include "estimator/paper/figures.hpp"

namespace shaker::estimator::paper {

inline const std::vector<int> kTimeFigures = {5, 6, 7, 9, 10};

// Reproduces one of kTimeFigures. The iterates are initial displacement and velocity, then theta.
// Throws std::invalid_argument for other figures.
FigureRun reproduce_time(int figure);

// Iterates of a fit to figure 9's record with the correct derivative.
std::vector<std::vector<double>> figure_nine_without_the_slip();

}  // namespace shaker::estimator::paper
