// Generalised least squares on the harmonics of several runs: theta, chi-squared, covariance.
//
// The standard error of each harmonic comes from the scatter of the cycles and not from the
// residuals of this fit. Chi-squared therefore says whether the model is good enough, and a step
// that would change it by less than a hundredth is not worth taking.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "config/model.hpp"
#include "estimator/diagnosis/fit/internal/prediction.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {

struct FitOptions {
  int points = 256;          // of the periodic solution
  int max_iterations = 200;  // valleys between parameters that look alike are long and bent
  double tolerance = 1e-2;   // of chi-squared
  bool from_rest = false;    // steps may go the long way to a periodic solution: dear
  bool from_near = false;  // no long way to a solution, where `near` has one: chi-squared infinite
  // Start values without a solution may be corrected (admit) where responses are compared too, and a
  // motion through a record is searched harder: dear.
  bool correct_start = false;
  bool sharp = false;    // corners as sharp as the points can follow (smoothing.hpp)
  bool at_once = false;  // friction jumps where it can (jumping_friction.hpp)
  // Chi-squared that is of no use. A fit that hardly comes nearer, and whose next step promises to
  // leave more than that, is given up.
  double hopeless = std::numeric_limits<double>::infinity();
  // Largest part of the data's evaluation budget for one fit; a fit that would take more is
  // stopped.
  double fit_budget = std::numeric_limits<double>::infinity();
};

// The sentence for a fit that was stopped.
constexpr const char* kTooLong =
    "the fit took all the work that one may take (its equations are stiff, or it creeps along a "
    "valley) and was stopped";

// A constant of the model file that was fitted with the parameters (select/friction_width.hpp).
struct FittedConstant {
  std::size_t line = 0;  // of the model file's effects
  std::string symbol, unit;
  double value = 0.0, standard_error = 0.0;
  Eigen::VectorXd bends;  // the free parameters, per unit of it
};

// A model and its predictions of the runs. Movable; use it from one thread.
struct HarmonicFit {
  config::ModelSpec spec;
  std::shared_ptr<const Model> model;
  // They differ in smoothing widths, and in what goes with a condition of the run.
  std::vector<std::shared_ptr<const Model>> run_models;
  std::vector<Prediction> predictions;  // one a run, in the campaign's order
  std::vector<double> theta;
  std::vector<int> free;       // parameters that were fitted
  Eigen::MatrixXd covariance;  // free x free; NaN where there is no solution
  double chi_squared = 0.0;    // over the runs that were fitted
  double condition = 0.0;      // of the whitened Jacobian with columns of unit length
  int observations = 0;
  int iterations = 0;
  bool converged = false;
  bool given_up = false;      // it came nowhere near what others leave
  bool stopped = false;       // it took all the budget that it may: nothing is known of it
  bool predicts_all = false;  // the runs that are held out too
  bool rounded = false;       // smoothing widths are those of the grid
  bool at_once = false;       // friction jumps
  std::string trouble;        // sentence when it did not
  // standard_error() includes the effect of this constant; `covariance` is that of the parameters
  // alone.
  std::optional<FittedConstant> constant;

  bool at_bound(int parameter) const;
  double standard_error(int parameter) const;  // 0 for a fixed one
};

// Whitened residuals (measured less predicted) and Jacobian of a run at the fit's solution.
Eigen::VectorXd whitened_residual(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                  std::size_t run);
Eigen::MatrixXd whitened_jacobian(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                  std::size_t run, const std::vector<int>& columns);

// The error of the time base that the residuals show, in standard deviations.
double clock_error(const HarmonicFit& fit, const std::vector<RunDatum>& data);

// Fits the runs with the role `fit` and predicts the others. `start`: all parameters, or empty for
// the model's own. `near`: a fit of a smaller model, from whose periodic solutions the search
// starts; may be null. Throws std::invalid_argument for a wrong model file.
HarmonicFit fit_harmonics(const config::ModelSpec& spec, const std::vector<RunDatum>& data,
                          const std::vector<double>& start, const HarmonicFit* near,
                          const FitOptions& options);

}  // namespace shaker::estimator::diagnosis
