// Least squares on records that are not periodic: free decays, drops, sweeps, random excitation.
// This is the time integration method of section 5.1. The response is integrated from initial
// conditions; the unknown ones are estimated together with theta.
//
// Long records are cut into segments with their own initial states (multiple shooting). Each step
// has one linearisation. It changes theta and the initial states, and it closes the gaps between
// the segments. The segments' states are condensed onto theta and the record's first state. At the
// solution the gaps are zero, so it is the solution of one trajectory. The segments start from the
// data and not from a simulation; the iteration therefore converges where a single trajectory
// diverges.
//
// Objective and inference are those of the periodic estimator (estimation.hpp): unweighted or
// weighted least squares (3.17), (3.15); covariance (3.27), noise (3.28), intervals (3.29). The
// singular values of the scaled Jacobian show which parameters the data do not determine.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimator/fit/estimate.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/model/model.hpp"
#include "estimator/solve/time/excitation.hpp"
#include "estimator/solve/time/integration.hpp"

namespace shaker::estimator {

struct InitialState {
  double value = 0.0;  // the known value, or the start of the iteration
  bool known = false;
  double lower = -1e300, upper = 1e300;
};

struct TransientRecord {
  std::string name;                  // for messages; empty: "record 1"
  std::vector<double> t;             // s, increasing
  std::vector<double> displacement;  // of the model's observed coordinate, at t
  Excitation excitation;
  // One for each state of StateEquations (the coordinates, then their velocities). Empty: all are
  // unknown and start from the data.
  std::vector<InitialState> initial;
  std::optional<double> start;  // time of `initial`, s; at most t[0], which is the default
  double weight = 1.0;          // relative inverse variance (3.15)
};

// What is known of the free parameters beside the records: a normal distribution. The standard
// deviation of a displacement of weight 1 gives it its weight, and scales the fit's covariance.
struct TransientPrior {
  std::vector<double> mean;        // of the free parameters, in the order of the model
  std::vector<double> covariance;  // likewise, row by row; directions without variance are held
  double noise = 0.0;              // above 0
};

struct TransientOptions {
  TimeOptions time;
  Method method = Method::levenberg_marquardt;  // or gauss_newton: full steps, (4.7)
  // Samples in a segment of multiple shooting. 0: chosen from the record's length. A number that is
  // not below the record's length: one trajectory.
  std::size_t segment = 0;
  int max_iterations = 60;
  double tolerance = 1e-9;  // change of a parameter, relative to it (or to the states' size)
  double confidence = 0.95;
  bool keep_iterates = false;  // store TransientFit::iterates
  std::optional<TransientPrior> prior;
};

// `covariance` refers to the free parameters, then the unknown initial states, record by record. An
// entry of `iterates` holds all initial states of the first record, then all of theta, as in the
// paper.
struct TransientFit : Fit {
  std::vector<std::vector<double>> initial;        // the first state of each record
  std::vector<std::vector<double>> initial_error;  // standard errors; 0 for known ones
  double largest_gap = 0.0;  // left between segments, relative to the states' size
  double prior_sum = 0.0;    // square of the distance from the prior's mean, in its own errors
};

// Workspace for one model and one set of records. Use it from one thread; it allocates.
class TransientEstimator {
 public:
  // `model` must outlive it. Throws std::invalid_argument with an explanation for records or
  // options that cannot be used: too few samples, values that are not finite, time that does not
  // increase, a prior of another size than the free parameters.
  TransientEstimator(const Model& model, std::vector<TransientRecord> records,
                     TransientOptions options = {});
  ~TransientEstimator();
  TransientEstimator(TransientEstimator&&) noexcept;
  TransientEstimator& operator=(TransientEstimator&&) noexcept;

  // Fits from `start` (all parameters of the model). Throws std::invalid_argument if its size is
  // wrong or the method is `lifted`. Other failures are reported in the status.
  const TransientFit& fit(const std::vector<double>& start);
  const TransientFit& last() const;

  // Prediction at the last fit's solution and the record's times.
  std::vector<double> predicted(std::size_t record) const;
  std::vector<double> residuals(std::size_t record) const;  // (5.7)
  // All states, times x states.
  std::vector<double> states(std::size_t record) const;
  // d predicted / d(free theta, then this record's unknown initial states), times x columns.
  std::vector<double> sensitivities(std::size_t record) const;

  const StateEquations& equations() const;

  // The complete last fit with names, units, intervals and warnings. Unknown initial states follow
  // the model's parameters, as effect "initial condition".
  Estimate describe() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::estimator
