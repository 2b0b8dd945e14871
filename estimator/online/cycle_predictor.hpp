// What a model predicts for a measured cycle, and how that changes with its free parameters: the
// measurement equation (5.4) of the sequential estimators in this folder.
//
// One periodic system for each run, warm from its last solution, under the cycle's own excitation.
// One thread; allocates when a run appears.
#pragma once

#include <map>
#include <vector>

#include <Eigen/Core>

#include "estimator/measured_cycle.hpp"
#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator::online {

struct Prediction {
  Eigen::VectorXd displacement;
  Eigen::MatrixXd jacobian;  // over the free parameters
  // J^T S for the cosine and sine parts S of the response to the excitation's first three
  // harmonics: how an error in the measured excitation gets into J^T e. Filled when it is wanted.
  Eigen::MatrixXd excitation_score;
};

class CyclePredictor {
 public:
  // `model` must outlive it.
  CyclePredictor(const Model& model, int grid_points) : model_(&model), points_(grid_points) {
    for (int k = 0; k < model.parameter_count(); ++k) {
      if (!model.parameters()[static_cast<std::size_t>(k)].fixed) free_.push_back(k);
    }
  }

  int parameters() const { return static_cast<int>(free_.size()); }
  const std::vector<int>& free() const { return free_; }
  // theta: all parameters of the model. False when there is no periodic solution.
  bool predict(const MeasuredCycle& cycle, const std::vector<double>& theta, bool with_excitation,
               Prediction& out);
  long solutions() const { return solutions_; }

 private:
  struct Run {
    PeriodicSystem system;
    bool warm = false;
  };
  const Model* model_;
  int points_;
  std::vector<int> free_;
  std::map<int, Run> runs_;
  long solutions_ = 0;
};

}  // namespace shaker::estimator::online
