/// \file
/// Least-squares estimation of the parameters theta from measured periods, with covariance.
///
/// Objectives:
///   - unweighted (3.17) and weighted (3.15) least squares on the samples of mean cycles. If the
///     noise variance is unknown, the maximum-likelihood theta is the same and the variance follows
///     from the residuals (3.28);
///   - generalised least squares on Fourier coefficients with their covariance.
/// Normal priors of the model's parameters are included in both (3.8). The estimate is then the
/// maximum a posteriori. objectives/ builds further objectives as loops around this class. Methods:
///   - lifted: Gauss-Newton on theta and the periodic solutions together, with one linearisation a
///     step. It needs about half the work of the nested methods and depends less on the start. If
///     it does not contract, the estimator falls back to levenberg_marquardt.
///   - gauss_newton: the paper's method (4.7): full steps, and for every theta the inner Newton
///     iteration converges first.
///   - levenberg_marquardt: gauss_newton with damping (4.8). It rejects steps that worsen the fit
///     or for which there is no admissible periodic solution.
///
/// All methods respect the bounds. Ceres solves the same problem (ceres_estimation.hpp), but it
/// evaluates residuals and Jacobians separately, cannot update the periodic solution with theta,
/// and allocates in its loop.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/run_condition.hpp"
#include "estimator/fit/estimate.hpp"
#include "estimator/model/model.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

/// One run: one excitation and the displacement measured in it, averaged over its cycles. Lengths
/// are in the model's length unit, accelerations in that unit per s^2.
struct RunData {
  double frequency_hz = 0.0;       ///< of the excitation, above 0
  double amplitude = 0.0;          ///< of a pure cosine, m/s^2; not used if `excitation` is given
  std::vector<double> excitation;  ///< m/s^2, one period on equal steps; empty: a pure cosine
  std::vector<double> tau;  ///< cyclic times of `displacement`, in [0, 1); empty: equal steps
  /// One value for each data point; at least 8.
  std::vector<double> displacement;
  /// Relative inverse variance of each sample (3.15). Empty: all samples have the same.
  std::vector<double> sample_weight;
  /// Instead of `displacement`: m Fourier coefficients of the mean cycle (mean, cos 1, sin 1, cos
  /// 2, ...; m odd, at least 3) with the m x m covariance of these means, row by row. Generalised
  /// least squares fits them, so the noise may have any spectrum. Either all runs of an estimation
  /// have coefficients or none has. See fit/harmonic_data.hpp.
  /// @{
  std::vector<double> harmonics, harmonic_covariance;
  /// @}
  /// Degrees of freedom of the covariance: cycles less one. 0: the covariance is known.
  double covariance_degrees = 0.0;
  /// Number of excitation periods in one record; `displacement`, `excitation` and `tau` span them
  /// all. It is above 1 for responses that repeat only after several periods. See
  /// solve/periodic/multi_period.hpp.
  int periods = 1;
  double cycles = 1.0;   ///< number averaged: each mean has 1 / cycles of the variance
  double scatter = 0.0;  ///< sum of squares of the single cycles about their mean
  double weight = 1.0;   ///< further weight (3.15), relative inverse variance
  /// Standard error of the cosine and sine parts of the mean excitation's harmonics, from the
  /// accelerometer's noise. It widens the covariance, see fit_inference_covariance.cpp. 0: the
  /// excitation is known exactly.
  double excitation_error = 0.0;
  /// Name, group and conditions, for parameters that differ from run to run.
  config::RunCondition condition;
  /// This run's own model, where parameters differ from run to run (model/run_models.hpp), with the
  /// parameters of the estimator's. Null: the estimator's model.
  std::shared_ptr<const Model> model;
  /// \param common the estimator's model
  /// \return the run's own model if it has one, otherwise `common`
  const Model& model_or(const Model& common) const { return model ? *model : common; }
};

/// Throws std::invalid_argument, with a sentence, unless a run is complete and consistent.
/// \param run what is checked
/// \param index of the run, from 0; named in the message
void check_run(const RunData& run, std::size_t index);

/// How the fit steps: see the top of this file.
enum class Method { lifted, gauss_newton, levenberg_marquardt };

/// How an Estimator fits.
struct EstimationOptions {
  /// `points` is a lower limit: it is raised to a multiple of the data's points.
  GridOptions grid{Scheme::order6, 160, true};
  Method method = Method::lifted;  ///< how the fit steps
  int max_iterations = 60;         ///< steps until the fit gives up
  double tolerance = 1e-9;  ///< relative, on the distance to the limit that the last steps predict
  int excitation_harmonics = 8;  ///< harmonics of a measured excitation that are used
  double confidence = 0.95;      ///< level of the intervals
  /// Known standard deviation of one observation, length unit; 0: from the residuals (3.28). Not
  /// used for Fourier coefficients.
  double noise = 0.0;
  bool keep_iterates = false;  ///< fill Fit::iterates
};

/// How a fit ended: `no_solution`: no periodic solution was found; `undetermined`: the data do not
/// determine every free parameter.
enum class FitStatus { converged, not_converged, no_solution, undetermined };

/// The numbers of an estimate. Vectors have the model's parameter order, except `covariance`, which
/// has the free parameters only.
struct Fit {
  FitStatus status = FitStatus::not_converged;  ///< how the fit ended
  std::vector<double> theta;                    ///< the estimate
  std::vector<double> standard_error;           ///< 0 for fixed parameters; NaN if undetermined
  std::vector<char> at_bound;                   ///< 1: the estimate lies at a bound
  std::vector<char> determined;                 ///< 1: the data determine it
  std::vector<double> covariance;  ///< free x free, row by row, in products of their units
  /// Directions in theta (all parameters) to which the data are insensitive.
  std::vector<std::vector<double>> lost;
  double noise = 0.0;             ///< s of (3.28); with Fourier coefficients, from their covariance
  double sum_of_squares = 0.0;    ///< of weighted residuals, including the scatter
  double condition = 0.0;         ///< condition number of the scaled Jacobian
  double quantile = 0.0;          ///< of Student's t, for the intervals
  double interval_degrees = 0.0;  ///< of that t; infinite if the noise is known
  /// Probability of residuals as large as these if the model is right. A small value means that the
  /// model lacks something. NaN with priors, or if the noise is known from the residuals only.
  double lack_of_fit = 0.0;
  /// Number of data, and that less the free parameters.
  /// @{
  long observations = 0, degrees_of_freedom = 0;
  /// @}
  int iterations = 0;   ///< steps of the fit
  bool nested = false;  ///< a nested method made this fit: the method asked for, or the fallback
  std::string trouble;  ///< a sentence if the fit did not converge; otherwise empty
  std::vector<std::vector<double>>
      iterates;  ///< theta after each step, if EstimationOptions::keep_iterates
};

/// The least-squares problem at a solution. Weights are worked into each datum, so that the
/// residuals are white with the standard deviation Estimator::unit_noise().
struct Linearised {
  std::vector<double> residual;  ///< measured less predicted
  std::vector<double> jacobian;  ///< of the prediction: datum x all parameters, row by row
  std::vector<int> run;          ///< index of the run to which a datum belongs
};

/// Workspace for one model and one set of runs. One thread at a time may use it. A further fit does
/// not allocate if it is lifted and converges, the data are samples of the same shape without
/// excitation error, and at most eight parameters are free.
class Estimator {
 public:
  /// `model` must outlive the estimator. Throws std::invalid_argument with a sentence for data that
  /// cannot be used: no run, too few points, non-finite values, a frequency that is not positive, a
  /// cosine without amplitude, or runs with samples beside runs with Fourier coefficients.
  /// \param model the model
  /// \param runs the data, one element for each run
  /// \param options how to fit
  Estimator(const Model& model, std::vector<RunData> runs, EstimationOptions options = {});
  /// Releases the workspace.
  ~Estimator();
  /// Takes the workspace over; the other may only be destroyed or assigned to.
  Estimator(Estimator&&) noexcept;
  /// Takes the workspace over; the other may only be destroyed or assigned to.
  /// \return this estimator
  Estimator& operator=(Estimator&&) noexcept;

  /// Replaces the data of a run by data of the same shape. The periodic solution is kept as a
  /// start. Throws std::invalid_argument for another shape or for data that cannot be used.
  /// \param run index of the run
  /// \param data the new data
  void update_run(std::size_t run, const RunData& data);

  /// Fits from `start` (all parameters; throws std::invalid_argument for another count). `warm`:
  /// the periodic solutions start from their present states. The reference is valid until the next
  /// fit.
  /// \param start all parameters, in the model's order and units
  /// \param warm true: keep the present periodic solutions
  /// \return the fit; `Fit::trouble` says why it did not converge
  const Fit& fit(const std::vector<double>& start, bool warm = false);
  /// \return the last fit
  const Fit& last() const;
  /// Interpolates the periodic solutions from those of `other`, which has the same runs on another
  /// grid. A warm fit then starts from them.
  /// \param other an estimator of the same model
  void start_from(const Estimator& other);

  /// \return the periodic solutions, one for each run
  const std::vector<PeriodicSystem>& solutions() const;
  /// Predicted displacement at the data points of a run, or its predicted Fourier coefficients,
  /// from the present periodic solutions.
  /// \param run index of the run
  /// \return one value for each datum of the run, in the model's length unit
  std::vector<double> predicted(std::size_t run) const;

  /// Profile fit: the optimum over the other free parameters with `parameter` held at
  /// theta[parameter]. It starts from `theta` and the present periodic solutions and leaves the
  /// optimum in `theta`. Returns how much worse the optimum is than the last fit, in variances of
  /// an observation; sqrt() of it compares with Student's t. Empty if no optimum is found. Throws
  /// std::invalid_argument if the parameter is not free. `last()` stays the last fit; `solutions()`
  /// and `linearised()` are those of the profile fit until `restore_solutions`.
  /// \param parameter index in theta of the parameter to hold
  /// \param theta all parameters; the held value at `parameter`
  /// \return the excess in variances of an observation, or nothing if no optimum is found
  std::optional<double> profile_fit(int parameter, std::vector<double>& theta);
  /// Extrapolates the present solutions along `change` of theta (all parameters), to first order.
  /// It gives the profile fit a start.
  /// \param change of each parameter, in the model's units
  void extrapolate_states(const std::vector<double>& change);
  /// Solves for the periodic solutions at the last fit's theta again.
  void restore_solutions();

  /// Whitened residuals and Jacobian of all data at the present solutions, without the priors.
  /// \return residuals and Jacobian of all data, run after run
  Linearised linearised() const;
  /// Linearises at a point: moves the periodic solutions to another theta near the last fit's,
  /// until `restore_solutions`.
  /// \param theta all parameters, in the model's order and units
  /// \return false if a run has no periodic solution there
  bool linearise_at(const std::vector<double>& theta);
  /// Standard deviation of a whitened datum: 1 for Fourier coefficients, else the known noise or
  /// the last fit's.
  /// \return the standard deviation of a whitened datum
  double unit_noise() const;

  /// The last fit with names, units, intervals and warnings. It expects the solutions of that fit.
  /// \return the estimate
  Estimate describe() const;

 private:
  friend class BatchEstimator;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::estimator
