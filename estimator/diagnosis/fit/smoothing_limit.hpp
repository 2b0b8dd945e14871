// A periodic prediction with corners of width 0, as no grid has them.
//
// Dry friction that is turned round over a width e creeps where a real damper sticks, and slips off
// a little late: the error goes with e and with e log e, and only then with their squares. So the
// run is solved with widths 4, 2, 1, ... times the finest, each on a grid whose steps go with the
// width, and every term is eliminated in turn (Neville's scheme, the logarithm as a double root).
// Grids are refined until what the last elimination changes is small beside the noise, or beside
// what is left of the run.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Dense>

#include "config/model.hpp"
#include "estimator/diagnosis/fit/prediction.hpp"
#include "estimator/diagnosis/run_datum.hpp"

namespace shaker::estimator::diagnosis {

constexpr double kLeftOpen = 0.3;  // of the noise, all harmonics of a run together

struct SmoothingLimit {
  Eigen::VectorXd value;  // of the run's harmonics
  Eigen::MatrixXd slope;  // over the parameters
  Eigen::VectorXd open;   // by how much the last elimination moved the values
};

// The rungs of a ladder, the coarsest first, each of half the width of the one before: values, and
// their slopes behind them. The entry of the scheme whose values the last elimination moved least,
// in units of the datum's noise. Two at least.
SmoothingLimit eliminated(const std::vector<Eigen::MatrixXd>& rungs, const RunDatum& datum);

// Of a periodic run, seen by `channels`, each as far as its own noise asks for. `points`: of the
// coarsest grid; `near`: a solution nearby; `matrices`: for all runs of one fit. Nothing where a
// grid of the first few has no solution. `left_open`, of the noise: enough.
std::optional<std::vector<SmoothingLimit>> smoothing_limits(
    const config::ModelSpec& spec, const std::vector<const RunDatum*>& channels,
    const std::vector<double>& theta, const Prediction& near, int points,
    AnalysisMatrices& matrices, double left_open = kLeftOpen);

}  // namespace shaker::estimator::diagnosis
