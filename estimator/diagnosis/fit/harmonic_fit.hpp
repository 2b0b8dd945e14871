// Generalised least squares on the harmonics of several runs: theta, chi-squared, covariance.
//
// Every harmonic counts by its own standard error, which comes from the scatter of the cycles and
// not from this fit's residuals; so chi-squared says whether the model is good enough, and a step
// that would change it by less than a hundredth of one is not worth taking.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "config/model.hpp"
#include "estimator/diagnosis/fit/prediction.hpp"
#include "estimator/diagnosis/run_datum.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {

struct FitOptions {
  int points = 256;          // of the periodic solution
  int max_iterations = 200;  // valleys between parameters that look alike are long and bent
  double tolerance = 1e-2;   // of chi-squared
  bool from_rest = false;    // steps may go the long way to a periodic solution: dear
  bool from_near = false;  // no long way to a solution, where `near` has one: chi-squared infinite
  bool sharp = false;      // corners as sharp as the points can follow (smoothing.hpp)
  // Of the budget of its data, that one fit may take; what would take more is given up.
  double fit_budget = std::numeric_limits<double>::infinity();
};

// Why a computation was given up.
constexpr const char* kTooLong =
    "the fit took all the work that one may take (its equations are stiff, or it creeps along a "
    "valley) and was stopped";

// A constant of the model file that was fitted beside the parameters (select/friction_width.hpp).
struct FittedConstant {
  std::size_t line = 0;  // of the model file's effects
  std::string symbol, unit;
  double value = 0.0, standard_error = 0.0;
  Eigen::VectorXd bends;  // the free parameters, per unit of it
};

// A model with the runs that it is held against. Movable; one thread.
struct HarmonicFit {
  config::ModelSpec spec;
  std::shared_ptr<const Model> model;
  std::vector<std::shared_ptr<const Model>> run_models;  // they differ in rounding widths only
  std::vector<Prediction> predictions;                   // one a run, in the campaign's order
  std::vector<double> theta;
  std::vector<int> free;       // parameters that were fitted
  Eigen::MatrixXd covariance;  // free x free; NaN where there is no solution
  double chi_squared = 0.0;    // over the runs that were fitted
  double condition = 0.0;      // of the whitened Jacobian with columns of unit length
  int observations = 0;
  int iterations = 0;
  bool converged = false;
  bool stopped = false;       // it took all the budget that it may: nothing is known of it
  bool predicts_all = false;  // the runs that are held out too
  std::string trouble;        // sentence when it did not
  // Its share is in standard_error(), not in the covariance, which is that of the parameters alone.
  std::optional<FittedConstant> constant;

  bool at_bound(int parameter) const;
  double standard_error(int parameter) const;  // 0 for a fixed one
};

// Whitened residuals (measured less predicted) and Jacobian of a run at the fit's solution.
Eigen::VectorXd whitened_residual(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                  std::size_t run);
Eigen::MatrixXd whitened_jacobian(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                  std::size_t run, const std::vector<int>& columns);

// The error of the time base that the residuals speak for, in standard deviations.
double clock_error(const HarmonicFit& fit, const std::vector<RunDatum>& data);

// Fits the runs whose role is `fit`; the others are predicted. `start`: all parameters, or empty
// for the model's own. `near`: a fit of a smaller model, whose periodic solutions are begun from.
// Throws std::invalid_argument for a model file that is wrong.
HarmonicFit fit_harmonics(const config::ModelSpec& spec, const std::vector<RunDatum>& data,
                          const std::vector<double>& start, const HarmonicFit* near,
                          const FitOptions& options);

}  // namespace shaker::estimator::diagnosis
