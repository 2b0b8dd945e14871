// The methods that Ceres does well: BFGS and nonlinear conjugate gradients (Polak-Ribiere) with a
// strong Wolfe search. Ceres contracts its step where a cost function says that it cannot be
// evaluated, which is how inadmissible steps are refused. It knows no bounds here: a step out of
// the box is refused like any other. (Its trust region does know them, but stops short of a minimum
// that lies on one: hence our own.)
#include <glog/logging.h>

#include <ceres/first_order_function.h>
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include "estimator/optimise/methods.hpp"
#include "estimator/optimise/scaled.hpp"

namespace shaker::estimator::optimise {
namespace {

// Ceres tells glog of every restart, whatever its own logging says: nothing for an operator.
class Quiet {
 public:
  Quiet() { FLAGS_minloglevel = google::GLOG_FATAL; }
  ~Quiet() { FLAGS_minloglevel = before_; }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  int before_ = FLAGS_minloglevel;
};

class Objective final : public ceres::FirstOrderFunction {
 public:
  explicit Objective(Scaled& scaled) : scaled_(scaled) {}
  int NumParameters() const override { return static_cast<int>(scaled_.unit().size()); }
  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    if (!scaled_.at(parameters, gradient != nullptr)) return false;
    *cost = scaled_.here().phi / scaled_.phi_unit();
    if (gradient != nullptr)
      Eigen::Map<Eigen::VectorXd>(gradient, NumParameters()) = scaled_.gradient();
    return true;
  }

 private:
  Scaled& scaled_;
};

Summary line_search(const char* method, LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                    const Options& options, ceres::LineSearchDirectionType direction) {
  Evaluator evaluator(problem, options);
  Point point;
  point.theta = start;
  if (!evaluator.at(point, true)) return evaluator.finish(method, Status::inadmissible, point);
  Scaled scaled(evaluator, point);
  Eigen::VectorXd x = scaled.to(point.theta);
  ceres::GradientProblem objective(new Objective(scaled));  // takes ownership
  ceres::GradientProblemSolver::Options solver;
  solver.line_search_direction_type = direction;
  solver.line_search_type = ceres::WOLFE;
  solver.nonlinear_conjugate_gradient_type = ceres::POLAK_RIBIERE;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = 1e-16;
  solver.gradient_tolerance = 1e-13;
  solver.parameter_tolerance = 0.1 * options.step_tolerance;
  solver.logging_type = ceres::SILENT;
  const Quiet quiet;
  ceres::GradientProblemSolver::Summary found;
  ceres::Solve(solver, objective, x.data(), &found);
  evaluator.summary().iterations = static_cast<int>(found.iterations.size()) - 1;
  return judge(method, scaled, found.termination_type == ceres::NO_CONVERGENCE);
}

}  // namespace

Summary bfgs(LeastSquaresProblem& problem, const Eigen::VectorXd& start, const Options& options) {
  return line_search("bfgs", problem, start, options, ceres::BFGS);
}

Summary conjugate_gradients(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                            const Options& options) {
  Options more = options;  // a step costs one gradient and no algebra, and many are needed
  more.max_iterations *= 10;
  return line_search("conjugate_gradients", problem, start, more,
                     ceres::NONLINEAR_CONJUGATE_GRADIENT);
}

}  // namespace shaker::estimator::optimise
