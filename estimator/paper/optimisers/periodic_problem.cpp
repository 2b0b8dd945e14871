#include "estimator/paper/optimisers/periodic_problem.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace shaker::estimator::optimisers {

PeriodicProblem::PeriodicProblem(const Model& model, std::vector<RunData> runs,
                                 EstimationOptions options)
    : model_(model), options_(options), fixed_(model.start()), unchanged_(fixed_.size(), 0.0) {
  if (runs.empty()) throw std::invalid_argument("there is no run to estimate from");
  for (int k = 0; k < model.parameter_count(); ++k) {
    if (!model.parameters()[static_cast<std::size_t>(k)].fixed) free_.push_back(k);
  }
  systems_.reserve(runs.size());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (runs[r].displacement.empty())
      throw std::invalid_argument(
          fmt::format("run {}: the methods are compared on displacements over time; it holds "
                      "Fourier coefficients only",
                      r + 1));
    check_run(runs[r], r);
    const int count = static_cast<int>(runs[r].displacement.size());
    GridOptions grid = options.grid;
    if (runs[r].tau.empty()) grid.points = count * ((grid.points + count - 1) / count);
    PeriodicSystem& system = systems_.emplace_back(runs[r].model_or(model), grid);
    if (runs[r].excitation.empty())
      system.set_excitation(runs[r].frequency_hz, runs[r].amplitude);
    else
      system.set_excitation(runs[r].frequency_hz, runs[r].excitation, options.excitation_harmonics);
    Run run;
    run.data = std::move(runs[r]);
    prepare(run, grid.points);
    observations_ += count;
    runs_.push_back(std::move(run));
  }
}

// Sets weights of the residuals and how the grid is read.
void PeriodicProblem::prepare(Run& run, int points) {
  const std::size_t count = run.data.displacement.size();
  for (std::size_t j = 0; j < count; ++j) {
    double weight = run.data.cycles * run.data.weight;
    if (!run.data.sample_weight.empty()) weight *= run.data.sample_weight[j];
    run.scale.push_back(std::sqrt(weight));
    GridReading reading;
    if (run.data.tau.empty())
      reading.base = static_cast<int>(j) * (points / static_cast<int>(count));
    else
      reading = grid_reading_at(run.data.tau[j], points);
    run.readings.push_back(reading);
  }
}

Eigen::VectorXd PeriodicProblem::lower() const {
  Eigen::VectorXd out(parameters());
  for (int k = 0; k < parameters(); ++k)
    out[k] = model_.parameters()[static_cast<std::size_t>(free_[k])].lower;
  return out;
}

Eigen::VectorXd PeriodicProblem::upper() const {
  Eigen::VectorXd out(parameters());
  for (int k = 0; k < parameters(); ++k)
    out[k] = model_.parameters()[static_cast<std::size_t>(free_[k])].upper;
  return out;
}

Eigen::VectorXd PeriodicProblem::reduce(const std::vector<double>& all) const {
  Eigen::VectorXd out(parameters());
  for (int k = 0; k < parameters(); ++k)
    out[k] = all.at(static_cast<std::size_t>(free_[k]));
  return out;
}

std::vector<double> PeriodicProblem::expand(const Eigen::VectorXd& theta) const {
  std::vector<double> all = fixed_;
  for (int k = 0; k < parameters(); ++k)
    all[static_cast<std::size_t>(free_[k])] = theta[k];
  return all;
}

void PeriodicProblem::forget() {
  for (Run& run : runs_)
    run.warm = false;
  solutions_ = 0;
}

// Solves all runs from their last good solutions, or from rest. After a failure the last good
// solution is kept for the next call.
bool PeriodicProblem::solve(const std::vector<double>& theta) {
  for (std::size_t r = 0; r < systems_.size(); ++r) {
    PeriodicSystem& system = systems_[r];
    Run& run = runs_[r];
    ++solutions_;
    SolveStatus status = SolveStatus::no_convergence;
    if (run.warm) {
      std::copy(run.good.begin(), run.good.end(), system.state().begin());
      status = system.solve(theta).status;
    }
    if (status != SolveStatus::converged) status = system.solve_from_rest(theta).status;
    if (status != SolveStatus::converged) return false;
    // Takes the last Newton step too: a line search depends on differences of phi of 1e-12 and
    // stops where they are noise.
    system.advance(1.0, unchanged_);
    run.good.assign(system.state().begin(), system.state().end());
    run.warm = true;
  }
  return true;
}

bool PeriodicProblem::evaluate(const Eigen::VectorXd& theta, Eigen::VectorXd& e,
                               Eigen::MatrixXd* jacobian) {
  if (!solve(expand(theta))) return false;
  e.resize(observations_);
  if (jacobian != nullptr) jacobian->setZero(observations_, parameters());
  Eigen::Index at = 0;
  const int c = model_.observed();
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    const Run& run = runs_[r];
    for (std::size_t j = 0; j < run.readings.size(); ++j, ++at) {
      const GridReading& reading = run.readings[j];
      double predicted = 0.0;
      for (int k = 0; k < reading.count; ++k) {
        const int point = (reading.base + k) % systems_[r].points();
        predicted += reading.weight[k] * systems_[r].value(point, c);
        if (jacobian == nullptr) continue;
        const auto row = systems_[r].row(point, c);
        for (int l = 0; l < parameters(); ++l)
          (*jacobian)(at, l) +=
              run.scale[j] * reading.weight[k] * row[static_cast<std::size_t>(1 + free_[l])];
      }
      e[at] = run.scale[j] * (run.data.displacement[j] - predicted);
    }
  }
  return true;
}

bool PeriodicProblem::curvature(const Eigen::VectorXd& theta, Eigen::MatrixXd& q) {
  Eigen::VectorXd e;
  if (!has_curvature() || !evaluate(theta, e, nullptr)) return false;
  q.setZero(parameters(), parameters());
  const auto all = expand(theta);
  const double* residuals = e.data();
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    if (!add_curvature(r, all, residuals, q)) return false;
    residuals += runs_[r].readings.size();
  }
  return true;
}

}  // namespace shaker::estimator::optimisers
