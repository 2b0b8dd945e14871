// Reproduction of the paper's periodic identifications: Verbeek (1991), section 6.2, figures 11 to
// 14.
//
// Each figure prints the iterates of a pure Gauss-Newton run with the second-order scheme on 40
// points. Figure 11 has no noise: its data are the periodic solution of the same equations (which
// hides the discretisation error, see discretisation_bias). The paper does not print the noise of
// figures 12 to 14. It is reconstructed from the printed iterates, which are linear in it, as the
// smallest noise that gives them. Figure 14 starts at its printed first iterate, which no converged
// inner solution reproduces. Units are feet and seconds as in the paper.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "config/model.hpp"
#include "estimator/fit/estimation.hpp"

namespace shaker::estimator::paper {

// The model (6.3) with the exact parameters as starts; `gravity` in ft/s^2.
config::ModelSpec oleo_in_feet(double gravity);
inline const std::vector<double> kExactTheta = {5.08, 5.0, 1.62, 1.0};

struct FigureRun {
  int figure = 0;
  std::vector<std::vector<double>> printed;   // iterates as printed, four decimals
  std::vector<std::vector<double>> iterates;  // ours
  double max_deviation = 0.0;
  double agreement = 0.0;    // deviation that the rounding of the print explains
  bool reproducible = true;  // false: the remark gives the reason for the disagreement
  std::vector<std::pair<std::string, std::string>> settings;
  std::string remark;
};

// Reproduces figure 11, 12, 13 or 14. Throws std::invalid_argument for others.
FigureRun reproduce(int figure);

// The data of figure 11, 12, 13 or 14, for other methods than that of the paper. `start` has an
// error of 5 %.
struct FigureData {
  config::ModelSpec model;
  RunData run;
  GridOptions grid;
  std::vector<double> start;
};
FigureData data_of(int figure);

// The discretisation error that the paper's test hides: data from an accurate solution, estimated
// on coarser grids.
struct DiscretisationRow {
  std::string figure;  // "11/12" or "14"
  int points = 0;
  std::string scheme;
  double stroke_error = 0.0;        // largest, ft, at the exact parameters
  std::vector<double> theta_error;  // per cent
};
std::vector<DiscretisationRow> discretisation_bias();

}  // namespace shaker::estimator::paper
