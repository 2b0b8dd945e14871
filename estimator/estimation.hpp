// Least squares on measured periods: theta, its covariance and what it is worth.
//
// Objectives: unweighted (3.17) and weighted (3.15) least squares; with unknown noise variance the
// maximum-likelihood theta is the same and the variance follows from the residuals (3.28).
// Generalised least squares on Fourier coefficients with their covariance. Normal priors of the
// model's parameters count in all of them (3.8): the estimate is then the maximum a posteriori.
// Further objectives are loops around this: see objectives/. Methods:
//   lifted              Gauss-Newton on theta and the periodic solutions together: one
//                       linearisation a step, about half the work of the nested form and less
//                       dependence on the start. Falls back to levenberg_marquardt when it does
//                       not contract.
//   gauss_newton        the paper's (4.7): inner Newton converged for every theta, full steps.
//   levenberg_marquardt the same with damping (4.8) that refuses steps which worsen the fit or for
//                       which there is no admissible periodic solution.
// All respect bounds. Ceres does this too (ceres_estimation.hpp) but evaluates residuals and
// Jacobians separately, cannot update the periodic solution with theta, and allocates in its loop.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/estimate.hpp"
#include "estimator/model.hpp"
#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

// One run: one excitation and the displacement measured in it, averaged over its cycles.
struct RunData {
  double frequency_hz = 0.0;
  double amplitude = 0.0;          // of a pure cosine; not used when `excitation` is given
  std::vector<double> excitation;  // one period on equal steps
  std::vector<double> tau;         // cyclic times of `displacement`, in [0, 1); empty: equal steps
  std::vector<double> displacement;
  // Relative inverse variance of each sample (3.15); empty: all the same.
  std::vector<double> sample_weight;
  // Instead of `displacement`: Fourier coefficients of the mean cycle (mean, cos 1, sin 1, cos 2,
  // ...; an odd count m >= 3) with the m x m covariance of these means, row by row. They are
  // fitted by generalised least squares, so the noise may be of any colour. All runs of an
  // estimation have covariances, or none. See objectives/harmonic_data.hpp.
  std::vector<double> harmonics, harmonic_covariance;
  double covariance_degrees = 0.0;  // of freedom, cycles less one; 0: the covariance is known
  // Of the excitation in one record (`displacement`, `excitation` and tau span them all), for
  // responses that repeat only after two, three, ... of them. See periodic/multi_period.hpp.
  int periods = 1;
  double cycles = 1.0;   // averaged: each mean has 1 / cycles of the variance
  double scatter = 0.0;  // sum of squares of the single cycles about their mean
  double weight = 1.0;   // further weight (3.15), relative inverse variance
  // Standard error of the cosine and sine parts of the mean excitation's harmonics, from the
  // accelerometer's noise; it widens the covariance, see estimation_worth.cpp. 0: known exactly.
  double excitation_error = 0.0;
};

enum class Method { lifted, gauss_newton, levenberg_marquardt };

struct EstimationOptions {
  GridOptions grid{Scheme::order6, 160,
                   true};  // points: the least; raised to a multiple of the data's
  Method method = Method::lifted;
  int max_iterations = 60;
  double tolerance = 1e-9;  // of theta, relative, predicted from the last steps
  int excitation_harmonics = 8;
  double confidence = 0.95;
  double noise = 0.0;  // known standard deviation of one observation; 0: from the residuals (3.28)
  bool keep_iterates = false;
};

enum class FitStatus { converged, not_converged, no_solution, undetermined };

// The numbers of an estimate, in the model's parameter order. `covariance` is of the free
// parameters.
struct Fit {
  FitStatus status = FitStatus::not_converged;
  std::vector<double> theta;
  std::vector<double> standard_error;  // 0 for fixed ones; NaN when undetermined
  std::vector<char> at_bound;
  std::vector<char> determined;
  std::vector<double> covariance;  // free x free, row by row
  // Changes of theta (all parameters) that the data do not feel.
  std::vector<std::vector<double>> lost;
  double noise = 0.0;
  double sum_of_squares = 0.0;  // of weighted residuals, scatter included
  double condition = 0.0;
  double quantile = 0.0;          // of Student's t, for the intervals
  double interval_degrees = 0.0;  // of that t; infinite when the noise is known
  // Probability of residuals as large as these if the model were right; NaN where only the
  // residuals tell the noise. Small: something is missing in the model.
  double lack_of_fit = 0.0;
  long observations = 0, degrees_of_freedom = 0;
  int iterations = 0;
  std::string trouble;  // sentence when not converged; empty otherwise
  std::vector<std::vector<double>> iterates;
};

// The least-squares problem at a solution: every datum with its weight worked in, so that the
// residuals are white and, for data with a covariance or a known noise, of unit variance.
struct Linearised {
  std::vector<double> residual;  // measured less predicted
  std::vector<double> jacobian;  // of the prediction over all parameters, row by row
  std::vector<int> run;          // that a datum belongs to
};

// Workspace for one model and one set of runs; one thread. After the first `fit` on data of one
// shape nothing allocates.
class Estimator {
 public:
  // `model` must outlive it. Throws std::invalid_argument with a sentence for data that cannot be
  // used: no points, non-finite values, a frequency that is not positive, an excitation that is
  // zero.
  Estimator(const Model& model, std::vector<RunData> runs, EstimationOptions options = {});
  ~Estimator();
  Estimator(Estimator&&) noexcept;
  Estimator& operator=(Estimator&&) noexcept;

  // Replaces the data of a run by data of the same shape, keeping the periodic solution as a start.
  void update_run(std::size_t run, const RunData& data);

  // From `start` (all parameters), or the model's own; `warm`: from the last solution's states.
  const Fit& fit(const std::vector<double>& start, bool warm = false);
  const Fit& last() const;
  // Periodic solutions from those that another grid has for the same runs, for a warm fit.
  void start_from(const Estimator& other);

  const std::vector<PeriodicSystem>& solutions() const;
  // Predicted displacement at the data's points of a run, or predicted Fourier coefficients, at the
  // last fit's solution.
  std::vector<double> predicted(std::size_t run) const;

  // --- with one free parameter held, for profiles. `last()` and `describe()` stay those of the
  // last fit; `solutions()` and `linearised()` are this one's until `recall`. Optimum over the
  // others, the held one at theta[parameter], from `theta` (there and back) and the present
  // periodic solutions: how much worse it is than the last fit, in variances of an observation, so
  // that sqrt() compares with Student's t. Empty when there is none to be found.
  std::optional<double> excess_holding(int parameter, std::vector<double>& theta);
  // Moves the present solutions along `change` of theta, to first order: a start for the above.
  void predict(const std::vector<double>& change);
  void recall();

  // Whitened residuals and rows of all data at the last fit; priors are not among them.
  Linearised linearised() const;
  // Moves the periodic solutions to another theta, near the last fit's, for `linearised()` there,
  // until `recall`. False when there are none.
  bool look_at(const std::vector<double>& theta);
  // Standard deviation of a whitened datum, as the last fit has it.
  double unit_noise() const;

  // The last fit in full, with names, units, intervals and warnings.
  Estimate describe() const;

 private:
  friend class BatchEstimator;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::estimator
