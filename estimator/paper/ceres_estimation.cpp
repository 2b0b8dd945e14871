#include "estimator/paper/internal/ceres_estimation.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

namespace shaker::estimator {
namespace {

// The residuals sqrt(weight) (prediction - data) of one run, and their Jacobian.
class RunCost final : public ceres::CostFunction {
 public:
  RunCost(const Model& model, const RunData& run, const EstimationOptions& options)
      : run_(&run), scale_(std::sqrt(run.cycles * run.weight)) {
    const int count = static_cast<int>(run.displacement.size());
    GridOptions grid = options.grid;
    every_ = (grid.points + count - 1) / count;
    grid.points = every_ * count;
    system_ = std::make_unique<PeriodicSystem>(model, grid);
    if (run.excitation.empty())
      system_->set_excitation(run.frequency_hz, run.amplitude);
    else
      system_->set_excitation(run.frequency_hz, run.excitation, options.excitation_harmonics);
    set_num_residuals(count);
    unchanged_.assign(static_cast<std::size_t>(model.parameter_count()), 0.0);
    mutable_parameter_block_sizes()->push_back(model.parameter_count());
  }

  void forget() { warm_ = false; }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const int p = parameter_block_sizes()[0];
    const std::span<const double> theta(parameters[0], static_cast<std::size_t>(p));
    SolveReport report;
    if (warm_) report = system_->solve(theta);
    if (!warm_ || report.status != SolveStatus::converged) report = system_->solve_from_rest(theta);
    warm_ = report.status == SolveStatus::converged;
    if (!warm_) return false;
    system_->advance(1.0, unchanged_);  // the rest of the Newton step would be noise in the cost
    for (int j = 0; j < num_residuals(); ++j) {
      residuals[j] = scale_ * (system_->observed(every_ * j) -
                               run_->displacement[static_cast<std::size_t>(j)]);
      if (jacobians == nullptr || jacobians[0] == nullptr) continue;
      const auto row = system_->observed_row(every_ * j);
      for (int k = 0; k < p; ++k)
        jacobians[0][j * p + k] = scale_ * row[static_cast<std::size_t>(1 + k)];
    }
    return true;
  }

 private:
  const RunData* run_;
  double scale_;
  int every_ = 1;
  std::vector<double> unchanged_;  // a zero step of theta
  std::unique_ptr<PeriodicSystem> system_;
  mutable bool warm_ = false;  // Evaluate is const for Ceres; one thread
};

ceres::Problem::Options costs_stay_here() {
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return ownership;
}

}  // namespace

struct CeresEstimator::Impl {
  const Model& model;
  EstimationOptions options;
  std::vector<RunData> runs;
  std::vector<std::unique_ptr<RunCost>> costs;

  void pose(ceres::Problem& problem, std::vector<double>& theta, const std::vector<int>& held);
  // Solves from result.theta with the held parameters fixed at their values.
  void solve(const std::vector<int>& held, CeresFit& result);
  // Adds to `held` the parameters that the gradient presses against their bound. Returns false
  // if there is no new one, or if all parameters are then held.
  bool hold_bounds(std::vector<double> theta, std::vector<int>& held);
};

void CeresEstimator::Impl::pose(ceres::Problem& problem, std::vector<double>& theta,
                                const std::vector<int>& held) {
  for (const auto& cost : costs) {
    cost->forget();
    problem.AddResidualBlock(cost.get(), nullptr, theta.data());
  }
  for (int k = 0; k < model.parameter_count(); ++k) {
    const ModelParameter& p = model.parameters()[static_cast<std::size_t>(k)];
    problem.SetParameterLowerBound(theta.data(), k, p.lower);
    problem.SetParameterUpperBound(theta.data(), k, p.upper);
  }
  if (!held.empty())
    problem.SetManifold(theta.data(), new ceres::SubsetManifold(model.parameter_count(), held));
}

void CeresEstimator::Impl::solve(const std::vector<int>& held, CeresFit& result) {
  ceres::Problem problem(costs_stay_here());
  pose(problem, result.theta, held);
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = 1e-16;
  solver.gradient_tolerance = 1e-16;
  solver.parameter_tolerance = options.tolerance;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.sum_of_squares = 2.0 * summary.final_cost;
  result.iterations += static_cast<int>(summary.iterations.size());
}

bool CeresEstimator::Impl::hold_bounds(std::vector<double> theta, std::vector<int>& held) {
  ceres::Problem problem(costs_stay_here());
  pose(problem, theta, {});
  std::vector<double> gradient;
  if (!problem.Evaluate({}, nullptr, nullptr, &gradient, nullptr)) return false;
  const std::size_t before = held.size();
  for (int k = 0; k < model.parameter_count(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    const ModelParameter& p = model.parameters()[at];
    const bool pressed = (theta[at] <= p.lower && gradient[at] > 0.0) ||
                         (theta[at] >= p.upper && gradient[at] < 0.0);
    if (pressed && std::find(held.begin(), held.end(), k) == held.end()) held.push_back(k);
  }
  return held.size() > before && held.size() < theta.size();
}

CeresEstimator::CeresEstimator(const Model& model, std::vector<RunData> runs,
                               EstimationOptions options)
    : impl_(new Impl{model, options, std::move(runs), {}}) {
  for (const RunData& run : impl_->runs) {
    if (!run.tau.empty()) throw std::invalid_argument("CeresEstimator takes equal steps only");
    impl_->costs.push_back(std::make_unique<RunCost>(model, run, options));
  }
}

CeresEstimator::~CeresEstimator() = default;

// Ceres projects its step onto the bounds but computes it without them: it does not account for
// what the other parameters should do while one stays on its bound. Near such an optimum its
// steps become short. It then reports convergence (linear oscillator: a step of 1e-14 after
// three iterations), or the trust region shrinks until the iterations are used up (oleo: 60 of
// them). The result is up to 0.11 standard errors away. Parameters that a solution leaves on a
// bound are therefore held there, and the others are solved for again.
CeresFit CeresEstimator::fit(const std::vector<double>& start) {
  CeresFit result;
  result.theta = start;
  std::vector<int> held;
  for (int k = 0; k < impl_->model.parameter_count(); ++k) {
    if (impl_->model.parameters()[static_cast<std::size_t>(k)].fixed) held.push_back(k);
  }
  impl_->solve(held, result);
  for (int again = 0; again < impl_->model.parameter_count(); ++again) {
    if (!impl_->hold_bounds(result.theta, held)) break;
    impl_->solve(held, result);
  }
  return result;
}

}  // namespace shaker::estimator
