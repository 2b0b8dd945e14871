// What sets of runs are worth. Private to the sources of the plan.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "estimator/design/plan.hpp"

namespace shaker::estimator {

// The runs of a set, and the share of the rig time of each.
struct RunShares {
  std::vector<std::size_t> runs;
  std::vector<double> share;
};

// Equal shares.
RunShares equally(std::vector<std::size_t> runs);

// Evaluates sets by their information in relative parameters, including the model's priors. Where a
// parameter has a value in each run, the information is that on the mean of the values. Keeps
// references to its arguments.
class PlanCriteria {
 public:
  PlanCriteria(const Model& model, const PlanOptions& options,
               const std::vector<PlanCandidate>& candidates, const std::vector<int>& free);

  // At the point of linearisation.
  Eigen::MatrixXd information(const RunShares& set) const { return information(set, at_.front()); }
  const Eigen::VectorXd& scale() const { return at_.front().scale; }
  // Logarithm of the relative errors' geometric mean; a smaller value is better.
  double volume(const RunShares& set) const;
  double error_of(const RunShares& set, Eigen::Index k) const;

  // True if a parameter has a value in each run.
  bool varies() const { return !own_.empty(); }
  bool aims() const { return !options_.aim.empty(); }
  // The standard error of what is aimed at, at the point of linearisation, and its median over the
  // prior.
  double aim_error(const RunShares& set) const { return aim_error(set, at_.front()); }
  double aim_over_prior(const RunShares& set) const;
  // What ranks sets: the volume; with an aim the mean over the prior of the logarithm of its error,
  // and a little of the volume.
  double criterion(const RunShares& set) const;

  // The cycles that run `i` of a set measures.
  double cycles(const RunShares& set, std::size_t i) const;

 private:
  // A damper at which sets are judged. `which`: index in the prior; -1: the point of linearisation.
  struct At {
    Eigen::VectorXd scale, aim;
    Eigen::MatrixXd prior;
    int which = -1;
  };
  At at(const Model& model, const std::vector<double>& theta, const std::vector<double>& aim,
        int which) const;
  Eigen::MatrixXd information(const RunShares& set, const At& at) const;
  Eigen::MatrixXd with_weak_prior(const RunShares& set, const At& at) const;
  double aim_error(const RunShares& set, const At& at) const;
  double volume(const RunShares& set, const At& at) const;

  const PlanOptions& options_;
  const std::vector<PlanCandidate>& candidates_;
  const std::vector<int>& free_;
  std::vector<Eigen::Index> own_;  // in free_: those that have a value in each run
  std::vector<At> at_;             // the point of linearisation first
};

}  // namespace shaker::estimator
