// The view of a problem for the methods of this folder: it counts evaluations, keeps theta inside
// the box, and refuses results that are not finite. Internal to the folder.
#pragma once

#include <vector>

#include "estimator/paper/optimisers/internal/problem.hpp"
#include "estimator/paper/optimisers/internal/summary.hpp"

namespace shaker::estimator::optimisers {

constexpr double kPhiRounding = 1e-15;  // of phi: smaller changes are rounding

// One theta with the evaluation there.
struct Point {
  Eigen::VectorXd theta, e;
  Eigen::MatrixXd jacobian;
  double phi = 0.0;  // 1/2 e^T e
};

class Evaluator {
 public:
  // Throws std::invalid_argument if a lower bound is above its upper bound.
  Evaluator(LeastSquaresProblem& problem, const Options& options);

  // Evaluates e, phi and, if required, J at point.theta, after putting it into the box. Returns
  // false, and counts a refusal, when theta is inadmissible or a result is not finite.
  bool at(Point& point, bool with_jacobian);
  bool curvature(const Eigen::VectorXd& theta, Eigen::MatrixXd& q);
  bool exhausted() const { return summary_.evaluations >= options_.max_evaluations; }

  // Indices of the parameters that can move: all but those on a bound where phi decreases outwards.
  std::vector<int> free(const Point& point) const;
  // The step without the components that leave the box from a bound where theta already is.
  Eigen::VectorXd along_box(const Point& point, Eigen::VectorXd step) const;
  Eigen::VectorXd into_box(const Eigen::VectorXd& theta) const;

  const Options& options() const { return options_; }
  LeastSquaresProblem& problem() { return problem_; }
  Summary& summary() { return summary_; }
  Summary finish(const char* method, Status status, const Point& point);

 private:
  LeastSquaresProblem& problem_;
  Options options_;
  Eigen::VectorXd lower_, upper_;
  Summary summary_;
};

// The columns `free` of a matrix.
Eigen::MatrixXd columns(const Eigen::MatrixXd& matrix, const std::vector<int>& free);
// Scales for steps of the parameters `free`: the norms of their columns, 1 for a column of zeros.
Eigen::VectorXd lengths(const Eigen::VectorXd& norms, const std::vector<int>& free);
// A step of the parameters `free` in the space of all parameters, zero for the others.
Eigen::VectorXd spread(const Eigen::VectorXd& step, const std::vector<int>& free, int parameters);

// The least-squares step J^+ e (4.7), with the smallest norm in scaled parameters when J is rank
// deficient, the relative offset |J J^+ e| / |e|, and the rank.
struct LinearStep {
  Eigen::VectorXd step;
  double offset = 0.0;
  int rank = 0;
};
LinearStep linear_step(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& e);

// Largest |step_k| / |theta_k|.
double relative(const Eigen::VectorXd& step, const Eigen::VectorXd& theta);

}  // namespace shaker::estimator::optimisers
