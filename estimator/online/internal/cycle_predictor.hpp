// Predicts a measured cycle and its derivatives with respect to the free parameters: the
// measurement equation (5.4) of the sequential estimators in this folder.
//
// Each run has one periodic system. It starts from its last solution and gets the excitation of
// the cycle itself. One thread at a time may use it. It allocates for a new run or number of
// points, and for the response to the excitation.
#pragma once

#include <map>
#include <vector>

#include <Eigen/Core>

#include "estimator/online/measured_cycle.hpp"
#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator::online {

struct Prediction {
  Eigen::VectorXd displacement;  // n points, in the model's length unit
  Eigen::MatrixXd jacobian;      // n x free parameters
  // J^T S (free parameters x 6). S holds the response to the cosine and sine parts of the
  // excitation's first three harmonics. It tells how an error in the measured excitation enters
  // J^T e. Computed on request only.
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
  // theta: all parameters of the model. Returns false if there is no periodic solution.
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
