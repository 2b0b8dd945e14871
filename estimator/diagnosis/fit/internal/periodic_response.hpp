// The periodic response of one run by one model, solved once at a theta for all channels that are
// predicted from it (displacement, load cell, accelerometer).
//
// The solution is kept. Therefore the next, nearby theta takes two or three Newton steps.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/internal/run_datum.hpp"
#include "estimator/model/model.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator::diagnosis {

// How hard to search for a solution: `near`, by a few Newton steps from the last one; `patient`, by
// as many as sharp corners need; `from_rest`, if those fail, by continuation from rest, and last from
// the measured cycle. A first solution is always searched from rest.
enum class HowFar { near, patient, from_rest };

// One thread.
class PeriodicResponse {
 public:
  // The response to the excitation of `datum`. `model` must outlive it.
  PeriodicResponse(const Model& model, const RunDatum& datum, int points);

  // Adds a channel, from the next `at` on. Returns its index.
  int look_at(Quantity quantity);
  // Returns false if there is no admissible solution at theta. The next search then starts from the
  // last success, or from the first start. At the theta of the last success nothing is solved
  // again.
  bool at(const std::vector<double>& theta, HowFar search);
  // A channel over the cycle and its derivatives at the last success: points x (1 + parameters).
  Eigen::MatrixXd curves(int channel) const;
  // Derivatives of the observed coordinate with respect to the cosines and sines of the excitation,
  // without its mean, at the last success: points x 2 Hx. Empty if the equations are singular.
  Eigen::MatrixXd over_excitation(int driver_harmonics);

  // Starts the search from another model's solution of the same run, for the coordinates that both
  // have.
  void start_from(const PeriodicResponse& other);
  // Starts the search from an extrapolation of solutions of this run on two coarser grids, with
  // twice and four times the width: the finer one plus half their difference.
  void start_beyond(const PeriodicResponse& finer, const PeriodicResponse& coarser);

  // Stores the present solution; go_back() starts the next search from it.
  void hold() { held_ = kept_; }
  void go_back();

  // Keeps the solution and frees the memory that only solving needs.
  void rest();

  const PeriodicSystem& system() const { return system_; }

 private:
  bool solve(const std::vector<double>& theta, HowFar search);
  void follow(const std::vector<double>& theta);
  // Returns true if a search has converged. Counts its cost, and takes the last Newton step if it
  // is ready.
  bool landed(const SolveReport& report);
  void begin_at(const std::vector<double>& state);
  bool begin_at_measured();

  PeriodicSystem system_;
  double tolerance_ = 0.0;  // of the residual, m/s^2
  std::vector<Quantity> channels_;
  std::vector<double> same_theta_;            // a change of none
  std::vector<double> theta_;                 // of the last success
  bool solved_ = false;                       // the state is one, if not of this system's model
  std::shared_ptr<EvaluationBudget> budget_;  // null: nobody asks
  bool current_ = false;                      // at theta_, linearised and seen through all channels
  // States: the start before any success, the last success, and the stored one.
  std::vector<double> begun_, kept_, held_;
  Eigen::VectorXd measured_;  // displacement, a point each; empty: another channel was measured
};

}  // namespace shaker::estimator::diagnosis
