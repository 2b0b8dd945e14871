// Methods of Ceres: BFGS and nonlinear conjugate gradients (Polak-Ribiere) with a strong Wolfe line
// search. Inadmissible steps are refused: Ceres shortens its step where a cost function cannot be
// evaluated. These methods have no bounds, so steps out of the box are refused in the same way.
// (Ceres' trust region has bounds but stops short of a minimum on one; hence trust_region.cpp.)
#include <glog/logging.h>

#include <ceres/first_order_function.h>
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include "estimator/paper/optimisers/internal/scaled.hpp"
#include "estimator/paper/optimisers/methods.hpp"

namespace shaker::estimator::optimisers {
namespace {

constexpr double kCollapsed = 0.999;  // share of the start's phi: the search failed if more remains

// Silences glog: Ceres logs every restart there, even with its own logging off.
class Quiet {
 public:
  Quiet() { FLAGS_minloglevel = google::GLOG_FATAL; }
  ~Quiet() { FLAGS_minloglevel = before_; }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  int before_ = FLAGS_minloglevel;
};

// The objective over y = x / step.
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

// Steps of single parameters that change the residuals by at most their norm at the start.
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
  // Ceres' first step has length one. Where the size of a parameter is far too long a step (a
  // linear oscillator near its resonance), the line search fails at the start. The second attempt
  // uses shorter units.
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
  Options more = options;  // steps are cheap (one gradient, no algebra), but many are needed
  more.max_iterations *= 10;
  return line_search("conjugate_gradients", problem, start, more,
                     ceres::NONLINEAR_CONJUGATE_GRADIENT);
}

}  // namespace shaker::estimator::optimisers
