// A model's prediction of a run's harmonics, with the derivatives with respect to the parameters:
// of the periodic response to an excitation, or of the force along an imposed motion. For a run
// without a period it predicts the cosines of the record.
//
// The predictions of all channels of a run may share its periodic response (periodic_response.hpp).
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/internal/imposed_motion.hpp"
#include "estimator/diagnosis/fit/internal/motion_integrator.hpp"
#include "estimator/diagnosis/fit/internal/periodic_response.hpp"
#include "estimator/diagnosis/fit/internal/transient_response.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {

class Prediction {
 public:
  // `model` must outlive it. As many harmonics are predicted as the datum has.
  Prediction(const Model& model, const RunDatum& datum, int points);
  // Another channel of the same periodic response (first_of_response). The response is solved once
  // for both and starts where `of` starts.
  Prediction(Prediction& of, const RunDatum& datum);

  // Predicts at `theta`. Returns false if there is no admissible periodic solution; the last
  // prediction then stays.
  bool at(const std::vector<double>& theta, HowFar search = HowFar::from_rest);
  const Eigen::VectorXd& value() const { return value_; }
  // (2 H + 1) x parameters.
  const Eigen::MatrixXd& jacobian() const { return jacobian_; }
  // Derivatives with respect to the cosines and sines of the excitation, without its mean: (2 H +
  // 1) x 2 Hx. Zero for an imposed motion.
  Eigen::MatrixXd over_excitation(int driver_harmonics);
  // Derivatives of a record's response with respect to the first `count` cosines of its excitation,
  // after a successful `at`. No columns for other runs.
  Eigen::MatrixXd over_record(const std::vector<double>& theta, Eigen::Index count) const;
  // Derivatives with respect to the harmonics of an imposed motion, the mean first: (2 H + 1) x (2
  // Hx + 1).
  Eigen::MatrixXd over_motion();

  // Starts the search from another model's solution of the same run, for the coordinates that both
  // have.
  void start_from(const Prediction& other);
  // Starts the search from an extrapolation of solutions of this run on two coarser grids, with
  // twice and four times the width: the finer one plus half their difference. An imposed motion
  // starts from the finer one.
  void start_beyond(const Prediction& finer, const Prediction& coarser);

  // A first motion through a record is searched harder (transient_response.hpp).
  void be_patient();
  // Stores the present solution; go_back() starts the next search from it.
  void hold();
  void go_back();

  // Uses one table of sines for both predictions, if they have equal numbers of harmonics and
  // points.
  void share(Prediction& other);
  void share(AnalysisMatrices& matrices);  // unless it has one

  // Keeps the solution and frees the memory that only solving needs.
  void rest() {
    if (response_) response_->rest();
  }

  const Model& model() const { return *model_; }
  int points() const { return points_; }
  // Null for an imposed motion. After rest() only its state and its excitation are available.
  const PeriodicSystem* response() const { return response_ ? &response_->system() : nullptr; }
  const ImposedMotion* imposed() const { return imposed_.get(); }  // null for a response
  // The response of a record; null for other runs, and for the force along a motion.
  const TransientResponse* transient() const { return transient_.get(); }
  // The record of a run without a period; null for other runs.
  const SampledRun* sampled() const { return sampled_.get(); }

 private:
  bool on_grid(const std::vector<double>& theta, HowFar search);
  const LeftFactor& analysis();
  bool alike(const Prediction& other) const;
  bool at_sampled(const std::vector<double>& theta);

  const Model* model_;
  int points_;
  int harmonics_;
  std::shared_ptr<PeriodicResponse> response_;  // one for all channels of the run
  int channel_ = 0;                             // of it
  bool follows_ = false;                        // another prediction begins it
  std::unique_ptr<ImposedMotion> imposed_;
  std::shared_ptr<const SampledRun> sampled_;
  std::unique_ptr<TransientResponse> transient_;  // of a sampled run: its response,
  std::unique_ptr<MotionIntegrator> integrator_;  // or the force along its motion
  std::unique_ptr<CosineTransform> transform_;
  std::shared_ptr<const ToLimit> to_limit_;
  Eigen::VectorXd excitation_;  // of a sampled run whose forces are compared, in cosines
  std::shared_ptr<const LeftFactor> analysis_;  // null until it is wanted
  std::vector<double> at_;                      // theta of the last success,
  bool is_at_ = false;                          // where everything still is
  Eigen::VectorXd value_;
  Eigen::MatrixXd jacobian_;
};

}  // namespace shaker::estimator::diagnosis
