#include "bench/plain_reference.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::bench {
namespace {

using namespace estimator;

constexpr int kHarmonics = 3;
// Relative to the stroke; the step after it is below 1e-8. It is the fastest of 1e-4 to 1e-10.
constexpr double kSmallStep = 1e-4;

class PlainRun final : public ceres::CostFunction {
 public:
  PlainRun(const Model& model, const RunData& run, GridOptions grid)
      : run_(run),
        system_(model, grid),
        every_(grid.points / static_cast<int>(run.displacement.size())),
        p_(model.parameter_count()) {
    system_.set_excitation(run.frequency_hz, run.amplitude);
    step_.resize(static_cast<std::size_t>(grid.points));
    rows_.resize(step_.size() * static_cast<std::size_t>(p_));
    set_num_residuals(static_cast<int>(run.displacement.size()));
    mutable_parameter_block_sizes()->push_back(p_);
  }

  void forget() const {
    theta_.clear();
    const auto count = static_cast<int>(run_.displacement.size());
    const auto z = system_.state();
    std::fill(z.begin(), z.end(), 0.0);
    for (int h = 0; h <= kHarmonics; ++h) {
      double c = 0.0, s = 0.0;
      for (int j = 0; j < count; ++j) {
        const double angle = 2.0 * std::numbers::pi * h * j / count;
        c += run_.displacement[static_cast<std::size_t>(j)] * std::cos(angle);
        s += run_.displacement[static_cast<std::size_t>(j)] * std::sin(angle);
      }
      const double share = (h == 0 ? 1.0 : 2.0) / count;
      for (std::size_t i = 0; i < z.size(); ++i) {
        const double angle =
            2.0 * std::numbers::pi * h * static_cast<double>(i) / static_cast<double>(z.size());
        z[i] += share * (c * std::cos(angle) + s * std::sin(angle));
      }
    }
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const std::span<const double> theta(parameters[0], static_cast<std::size_t>(p_));
    if (!std::equal(theta.begin(), theta.end(), theta_.begin(), theta_.end()) && !solve(theta))
      return false;
    for (int j = 0; j < num_residuals(); ++j)
      residuals[j] = system_.value(every_ * j, 0) - run_.displacement[static_cast<std::size_t>(j)];
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    const int n = system_.points();
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < p_; ++k)
        rows_[static_cast<std::size_t>(i * p_ + k)] = -system_.g_theta(i, 0, k);
    }
    system_.solve_factorised(rows_, p_);
    for (int j = 0; j < num_residuals(); ++j)
      std::copy_n(&rows_[static_cast<std::size_t>(every_ * j * p_)], p_, jacobians[0] + j * p_);
    return true;
  }

 private:
  bool solve(std::span<const double> theta) const {
    theta_.assign(theta.begin(), theta.end());
    for (int iteration = 0; iteration < 30; ++iteration) {
      if (!system_.linearise(theta) || !system_.factorise()) return false;
      for (int i = 0; i < system_.points(); ++i)
        step_[static_cast<std::size_t>(i)] = -system_.g(i, 0);
      system_.solve_factorised(step_, 1);
      const auto z = system_.state();
      double size = 0.0, step = 0.0;
      for (std::size_t i = 0; i < z.size(); ++i) {
        z[i] += step_[i];
        step = std::max(step, std::fabs(step_[i]));
        size = std::max(size, std::fabs(z[i]));
      }
      if (!std::isfinite(step)) return false;
      if (step <= kSmallStep * size) return true;
    }
    return false;
  }

  RunData run_;
  mutable PeriodicSystem system_;  // Evaluate is const in Ceres; for one thread
  int every_, p_;
  mutable std::vector<double> theta_, step_, rows_;
};

}  // namespace

struct PlainReference::Impl {
  Impl(const Model& model, const RunData& run, GridOptions grid) : cost(model, run, grid) {}
  PlainRun cost;
  std::vector<double> theta;
  std::unique_ptr<ceres::Problem> problem;
  ceres::Solver::Options options;
  int iterations = 0;
};

PlainReference::PlainReference(const Model& model, RunData run, Scheme scheme, int points,
                               double tolerance)
    : impl_(std::make_unique<Impl>(model, run, GridOptions{scheme, points, false})) {
  impl_->theta = model.start();
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  impl_->problem = std::make_unique<ceres::Problem>(ownership);
  impl_->problem->AddResidualBlock(&impl_->cost, nullptr, impl_->theta.data());
  impl_->options.linear_solver_type = ceres::DENSE_QR;
  impl_->options.function_tolerance = 1e-16;
  impl_->options.gradient_tolerance = 1e-16;
  impl_->options.parameter_tolerance = tolerance;
  impl_->options.logging_type = ceres::SILENT;
}

PlainReference::~PlainReference() = default;

const std::vector<double>& PlainReference::fit(const std::vector<double>& start) {
  std::copy(start.begin(), start.end(), impl_->theta.begin());
  impl_->cost.forget();
  ceres::Solver::Summary summary;
  ceres::Solve(impl_->options, impl_->problem.get(), &summary);
  impl_->iterations = static_cast<int>(summary.iterations.size());
  return impl_->theta;
}

int PlainReference::iterations() const {
  return impl_->iterations;
}

}  // namespace shaker::bench
