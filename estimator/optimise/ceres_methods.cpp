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

constexpr double kCollapsed = 0.999;  // of the start's phi is left

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

// Over y = x / step.
class Objective final : public ceres::FirstOrderFunction {
 public:
  Objective(Scaled& scaled, const Eigen::VectorXd& step) : scaled_(scaled), step_(step) {}
  int NumParameters() const override { return static_cast<int>(step_.size()); }
  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    const Eigen::VectorXd x =
        Eigen::Map<const Eigen::VectorXd>(parameters, step_.size()).cwiseProduct(step_);
    if (!scaled_.at(x.data(), gradient != nullptr)) return false;
    *cost = scaled_.here().phi / scaled_.phi_unit();
    if (gradient != nullptr)
      Eigen::Map<Eigen::VectorXd>(gradient, step_.size()) = scaled_.gradient().cwiseProduct(step_);
    return true;
  }

 private:
  Scaled& scaled_;
  Eigen::VectorXd step_;
};

// That change the residuals by as much as there is of them at the start.
Eigen::VectorXd natural_steps(const Point& point, const Scaled& scaled) {
  Eigen::VectorXd step = Eigen::VectorXd::Ones(scaled.unit().size());
  for (Eigen::Index k = 0; k < step.size(); ++k) {
    const double felt = point.jacobian.col(k).norm() * scaled.unit()[k];
    if (felt > point.e.norm()) step[k] = point.e.norm() / felt;
  }
  return step;
}

Summary line_search(const char* method, LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                    const Options& options, ceres::LineSearchDirectionType direction) {
  Evaluator evaluator(problem, options);
  Point point;
  point.theta = start;
  if (!evaluator.at(point, true)) return evaluator.finish(method, Status::inadmissible, point);
  Scaled scaled(evaluator, point);
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
  // Ceres' first step is of length one. Where a parameter's own size is far too long a step (a
  // linear oscillator near its resonance) its search for the length collapses at the start, and
  // gets on with shorter units.
  ceres::GradientProblemSolver::Summary found;
  const Eigen::VectorXd own = Eigen::VectorXd::Ones(scaled.unit().size());
  for (const Eigen::VectorXd& step : {own, natural_steps(point, scaled)}) {
    Eigen::VectorXd x = scaled.to(point.theta).cwiseQuotient(step);
    ceres::GradientProblem objective(new Objective(scaled, step));  // takes ownership
    ceres::Solve(solver, objective, x.data(), &found);
    if (found.final_cost < kCollapsed * found.initial_cost) break;
  }
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
