// Least squares on records that are not periodic: free decays, drops, sweeps, random excitation.
// The time integration method of section 5.1: the response is integrated from initial conditions,
// which are parameters too unless they are known.
//
// Long records are cut into segments with initial states of their own (multiple shooting); theta,
// the initial states and the gaps between segments are driven together, one linearisation a step,
// and the segments' states are condensed onto theta and the record's first state. The solution is
// that of one trajectory: the gaps end at nothing. It begins from the data instead of from a
// simulation, so that it converges where a single trajectory runs away.
//
// Objective and worth are those of the periodic estimator (estimation.hpp): unweighted or weighted
// least squares (3.17), (3.15); covariance (3.27), noise (3.28), intervals (3.29), parameters that
// the data do not determine by the singular values of the scaled Jacobian.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimator/estimate.hpp"
#include "estimator/estimation.hpp"
#include "estimator/model.hpp"
#include "estimator/time/excitation.hpp"
#include "estimator/time/integration.hpp"

namespace shaker::estimator {

struct InitialState {
  double value = 0.0;  // known, or where to begin
  bool known = false;
  double lower = -1e300, upper = 1e300;
};

struct TransientRecord {
  std::string name;                  // for messages; empty: "record 1"
  std::vector<double> t;             // s, increasing
  std::vector<double> displacement;  // of the model's observed coordinate, at t
  Excitation excitation;
  // One for each state of StateEquations (the coordinates, then their velocities). Empty: all
  // unknown, begun from the data.
  std::vector<InitialState> initial;
  std::optional<double> start;  // where `initial` holds; not after t[0], which is the default
  double weight = 1.0;          // relative inverse variance (3.15)
};

struct TransientOptions {
  TimeOptions time;
  Method method = Method::levenberg_marquardt;  // or gauss_newton: full steps, (4.7)
  // Samples in a segment of multiple shooting; 0: chosen from the record's length; a number not
  // below the record's length: one trajectory.
  std::size_t segment = 0;
  int max_iterations = 60;
  double tolerance = 1e-9;  // change of a parameter, relative to it (or to the states' size)
  double confidence = 0.95;
  bool keep_iterates = false;  // initial states that are free, then all of theta
};

// `covariance` is of the free parameters, then the unknown initial states, record by record. An
// iterate of `iterates` holds the initial states of the first record, then theta, as the paper's.
struct TransientFit : Fit {
  std::vector<std::vector<double>> initial;        // a record's first state
  std::vector<std::vector<double>> initial_error;  // standard errors; 0 for known ones
  double largest_gap = 0.0;  // left between segments, relative to the states' size
};

// Workspace for one model and one set of records; one thread.
class TransientEstimator {
 public:
  // `model` must outlive it. Throws std::invalid_argument with a sentence for records that cannot
  // be used: too few samples, values that are not finite, time that does not increase.
  TransientEstimator(const Model& model, std::vector<TransientRecord> records,
                     TransientOptions options = {});
  ~TransientEstimator();
  TransientEstimator(TransientEstimator&&) noexcept;
  TransientEstimator& operator=(TransientEstimator&&) noexcept;

  // From `start` (all parameters of the model).
  const TransientFit& fit(const std::vector<double>& start);
  const TransientFit& last() const;

  // At the last fit's solution, at the record's times.
  std::vector<double> predicted(std::size_t record) const;
  std::vector<double> residuals(std::size_t record) const;  // (5.7)
  // All states, times x states.
  std::vector<double> states(std::size_t record) const;
  // d predicted / d(free theta, then this record's unknown initial states), times x columns.
  std::vector<double> sensitivities(std::size_t record) const;

  const StateEquations& equations() const;

  // The last fit in full, with names, units, intervals and warnings. Unknown initial states follow
  // the model's parameters, as effect "initial condition".
  Estimate describe() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shaker::estimator
