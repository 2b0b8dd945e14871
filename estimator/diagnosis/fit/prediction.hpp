// A model's prediction of a run's harmonics and its derivatives over the parameters: of the
// periodic response to an excitation, or of the force along an imposed motion; of a run that is not
// periodic the same in the cosines of its record.
//
// A run's periodic response may be shared by the predictions of all its channels
// (periodic_response.hpp).
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Dense>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/imposed_motion.hpp"
#include "estimator/diagnosis/fit/imposed_motion_bdf2.hpp"
#include "estimator/diagnosis/fit/periodic_response.hpp"
#include "estimator/diagnosis/fit/transient_response.hpp"
#include "estimator/diagnosis/run_datum.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator::diagnosis {

class Prediction {
 public:
  // `model` must outlive it. As many harmonics are predicted as the datum has.
  Prediction(const Model& model, const RunDatum& datum, int points);
  // Another channel of the same periodic response (first_of_response): solved once for both, from
  // where `of` begins.
  Prediction(Prediction& of, const RunDatum& datum);

  // False when there is no admissible periodic solution at theta; what was predicted before stays.
  bool at(const std::vector<double>& theta, HowFar search = HowFar::from_rest);
  const Eigen::VectorXd& value() const { return value_; }
  // (2 H + 1) x parameters.
  const Eigen::MatrixXd& jacobian() const { return jacobian_; }
  // (2 H + 1) x 2 Hx: over the excitation's cosines and sines, without its mean. Zero for an
  // imposed motion.
  Eigen::MatrixXd over_excitation(int driver_harmonics);
  // Of a record's response: over the first `count` cosines of its excitation, where `at` succeeded;
  // no columns for anything else.
  Eigen::MatrixXd over_record(const std::vector<double>& theta, Eigen::Index count) const;
  // (2 H + 1) x (2 Hx + 1): over the harmonics of an imposed motion, its mean first.
  Eigen::MatrixXd over_motion();

  // Begins from another model's solution of the same run: as far as coordinates are shared.
  void start_from(const Prediction& other);
  // From solutions of this run on two coarser grids, of twice the width and of four times it, as
  // far beyond the finer one as that half their difference leads. Periodic responses only.
  void start_beyond(const Prediction& finer, const Prediction& coarser);

  // Holds the present periodic solution, to begin from again after tries that led elsewhere.
  void hold();
  void go_back();

  // One table of sines for both, where they are of as many harmonics and points.
  void share(Prediction& other);
  void share(AnalysisMatrices& matrices);  // unless it has one

  // Keeps the solution, and gives back what only solving needs.
  void rest() {
    if (response_) response_->rest();
  }

  const Model& model() const { return *model_; }
  int points() const { return points_; }
  // Null for imposed motion. After rest() its state and its excitation are there, and no more.
  const PeriodicSystem* response() const { return response_ ? &response_->system() : nullptr; }
  const ImposedMotion* imposed() const { return imposed_.get(); }  // null for a response
  // Of a run that is not periodic, null for others: its record.
  const SampledRun* sampled() const { return sampled_.get(); }

 private:
  bool on_grid(const std::vector<double>& theta, HowFar search);
  const Eigen::MatrixXd& analysis();
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
  std::shared_ptr<const Eigen::MatrixXd> analysis_;  // null until it is wanted
  std::vector<double> at_;                           // theta of the last success,
  bool is_at_ = false;                               // where everything still is
  Eigen::VectorXd value_;
  Eigen::MatrixXd jacobian_;
};

}  // namespace shaker::estimator::diagnosis
