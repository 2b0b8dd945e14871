// A problem as the methods of this folder see it: counted, inside its box, and with nothing that is
// not finite. Internal to the folder.
#pragma once

#include <vector>

#include "estimator/optimise/problem.hpp"
#include "estimator/optimise/summary.hpp"

namespace shaker::estimator::optimise {

constexpr double kPhiRounding = 1e-15;  // of phi: what a smaller change would be lost in

// One theta with what is known there.
struct Point {
  Eigen::VectorXd theta, e;
  Eigen::MatrixXd jacobian;
  double phi = 0.0;  // 1/2 e^T e
};

class Evaluator {
 public:
  Evaluator(LeastSquaresProblem& problem, const Options& options);

  // At point.theta, which is first put into the box. False, counted as a refusal, when it is
  // inadmissible or the answer is not finite.
  bool at(Point& point, bool with_jacobian);
  bool curvature(const Eigen::VectorXd& theta, Eigen::MatrixXd& q);
  bool exhausted() const { return summary_.evaluations >= options_.max_evaluations; }

  // Parameters that may move: not those that sit on a bound with phi falling outwards.
  std::vector<int> free(const Point& point) const;
  // A step without the parts that would leave the box from a bound on which theta already sits.
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

// Columns `free` of a matrix, and a step of those in the whole space.
Eigen::MatrixXd columns(const Eigen::MatrixXd& matrix, const std::vector<int>& free);
// Lengths by which steps of the parameters `free` are measured: those of their columns, 1 for a
// column of zeros.
Eigen::VectorXd lengths(const Eigen::VectorXd& norms, const std::vector<int>& free);
Eigen::VectorXd spread(const Eigen::VectorXd& step, const std::vector<int>& free, int parameters);

// The least-squares step J^+ e (4.7), of least norm in scaled parameters when J lacks rank, and
// |J J^+ e| / |e|.
struct LinearStep {
  Eigen::VectorXd step;
  double offset = 0.0;
  int rank = 0;
};
LinearStep linear_step(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& e);

// Largest |step_k| / |theta_k|.
double relative(const Eigen::VectorXd& step, const Eigen::VectorXd& theta);

}  // namespace shaker::estimator::optimise
