// A periodic prediction in the limit of zero smoothing width, which no grid has.
//
// Dry friction that reverses over a width e creeps where a real damper sticks, and slips a little
// late. The error has terms in e and e log e, then in their squares. The run is therefore solved
// with 1, 2, 4, ... times the finest width, each on a grid in proportion to the width, and the
// terms are eliminated one after another (Neville's scheme, the logarithm as a double root). The
// grids are refined until the last elimination changes little compared with the noise, or with the
// residual of the run.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Dense>

#include "config/model.hpp"
#include "estimator/diagnosis/fit/internal/prediction.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"

namespace shaker::estimator::diagnosis {

constexpr double kLeftOpen = 0.3;  // of the noise, all harmonics of a run together

struct SmoothingLimit {
  Eigen::VectorXd value;  // of the run's harmonics
  Eigen::MatrixXd slope;  // over the parameters
  Eigen::VectorXd open;   // by how much the last elimination moved the values
};

// Eliminates the terms from solutions of the same run, the coarsest first, each with half the width
// of the one before. A matrix has the values in its first column and their derivatives after it.
// Returns the entry of the scheme whose values the last elimination moved least, in units of the
// datum's noise. Needs two solutions.
SmoothingLimit eliminated(const std::vector<Eigen::MatrixXd>& rungs, const RunDatum& datum);

// Computes the limit for a periodic run in all its `channels`, each as exactly as its noise
// requires. `points`: of the coarsest grid; `near`: a nearby solution; `matrices`: shared by all
// runs of one fit. Empty if one of the first grids has no solution. `left_open`: accepted error,
// relative to the noise.
std::optional<std::vector<SmoothingLimit>> smoothing_limits(
    const config::ModelSpec& spec, const std::vector<const RunDatum*>& channels,
    const std::vector<double>& theta, const Prediction& near, int points,
    AnalysisMatrices& matrices, double left_open = kLeftOpen);

}  // namespace shaker::estimator::diagnosis
