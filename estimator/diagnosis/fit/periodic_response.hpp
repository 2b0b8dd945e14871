// The periodic response of one run by one model, solved once at a theta for all the channels that
// are predicted of it (displacement, load cell, accelerometer).
//
// The solution is kept, so that the next, nearby theta costs two or three Newton steps.
#pragma once

#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/run_datum.hpp"
#include "estimator/model/model.hpp"
#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator::diagnosis {

// How far a solution is sought: by a few Newton steps from the last one; by as many as sharp
// corners want; and where those do not lead to it from rest, the long way. Where nothing has been
// solved yet there is only the last.
enum class HowFar { near, patient, from_rest };

// One thread.
class PeriodicResponse {
 public:
  // To the excitation of `datum`. `model` must outlive it.
  PeriodicResponse(const Model& model, const RunDatum& datum, int points);

  // Among the channels from the next `at` on; returns its place there.
  int look_at(Quantity quantity);
  // False when there is no admissible solution at theta; the next search then begins at the last
  // success, or where this one began. At the theta of that nothing is solved again.
  bool at(const std::vector<double>& theta, HowFar search);
  // points x (1 + parameters): a channel over the cycle and its derivatives, at the last success.
  Eigen::MatrixXd curves(int channel) const;
  // points x 2 Hx: the observed coordinate over the excitation's cosines and sines, without its
  // mean, at the last success; empty where that is singular.
  Eigen::MatrixXd over_excitation(int driver_harmonics);

  // Begins from another model's solution of the same run: as far as coordinates are shared.
  void start_from(const PeriodicResponse& other);
  // From solutions of this run on two coarser grids, of twice the width and of four times it, as
  // far beyond the finer one as that half their difference leads.
  void start_beyond(const PeriodicResponse& finer, const PeriodicResponse& coarser);

  // Holds the present solution, to begin from again after tries that led elsewhere.
  void hold() { held_ = kept_; }
  void go_back();

  // Keeps the solution, and gives back what only solving needs.
  void rest();

  const PeriodicSystem& system() const { return system_; }

 private:
  bool solve(const std::vector<double>& theta, HowFar search);
  void follow(const std::vector<double>& theta);
  // Whether a search has arrived; counts what it cost, and takes the step that it has ready there.
  bool landed(const SolveReport& report);
  void begin_at(const std::vector<double>& state);

  PeriodicSystem system_;
  double tolerance_ = 0.0;  // of the residual, m/s^2
  std::vector<Quantity> channels_;
  std::vector<double> same_theta_;            // a change of none
  std::vector<double> theta_;                 // of the last success
  bool solved_ = false;                       // the state is one, if not of this system's model
  std::shared_ptr<EvaluationBudget> budget_;  // null: nobody asks
  bool current_ = false;                      // at theta_, linearised and seen through all channels
  // States: where it began before any success, of the last one, and the one held.
  std::vector<double> begun_, kept_, held_;
};

}  // namespace shaker::estimator::diagnosis
