#include "estimator/fit/estimation.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/fit/harmonic_data.hpp"
#include "estimator/fit/internal/estimation_impl.hpp"

namespace shaker::estimator {

Estimator::Impl::Impl(const Model& model, std::vector<RunData> runs,
                      const EstimationOptions& options)
    : data(model, std::move(runs), options),
      solutions(data),
      equations(data),
      search{data, solutions, equations, fit},
      lifted(search),
      nested(search),
      inference(data, solutions, equations, fit) {
  const auto p = static_cast<std::size_t>(model.parameter_count());
  fit.theta.resize(p);
  fit.standard_error.resize(p);
  fit.at_bound.resize(p);
  fit.determined.resize(p);
  fit.covariance.resize(data.free.size() * data.free.size());
}

Estimator::Estimator(const Model& model, std::vector<RunData> runs, EstimationOptions options)
    : impl_(std::make_unique<Impl>(model, std::move(runs), options)) {}
Estimator::~Estimator() = default;
Estimator::Estimator(Estimator&&) noexcept = default;
Estimator& Estimator::operator=(Estimator&&) noexcept = default;

void Estimator::update_run(std::size_t run, const RunData& data) {
  RunState& state = impl_->data.runs.at(run);
  if (data.displacement.size() != state.data.displacement.size() ||
      data.excitation.size() != state.data.excitation.size() ||
      data.tau.size() != state.data.tau.size() ||
      data.sample_weight.size() != state.data.sample_weight.size() ||
      data.harmonics.size() != state.data.harmonics.size() || data.periods != state.data.periods)
    throw std::invalid_argument("update_run: the data have another shape than the run");
  check_run(data, run);
  state.data = data;
  impl_->data.load(run);
  impl_->solutions.load(run);
}

const Fit& Estimator::fit(const std::vector<double>& start, bool warm) {
  Impl& impl = *impl_;
  Fit& fit = impl.fit;
  if (start.size() != fit.theta.size())
    throw std::invalid_argument(
        fmt::format("the start has {} parameters, the model {}", start.size(), fit.theta.size()));
  fit.theta = start;
  fit.iterates.clear();
  fit.trouble.clear();
  fit.iterations = 0;
  fit.status = FitStatus::not_converged;
  const bool lifted = impl.data.options.method == Method::lifted;
  fit.nested = !lifted || !impl.lifted.run(warm);
  if (fit.nested) {
    fit.theta = start;
    fit.iterates.clear();
    impl.nested.run(start, warm && !lifted, impl.data.options.method != Method::gauss_newton);
  }
  if (!warm && impl.data.options.method != Method::gauss_newton &&
      (fit.status == FitStatus::not_converged || fit.status == FitStatus::no_solution ||
       impl.data.fitted_badly(impl.solutions.systems)))
    impl.refit_on_data_branch(start);
  impl.inference.finish();
  return fit;
}

std::optional<double> Estimator::profile_fit(int parameter, std::vector<double>& theta) {
  Impl& impl = *impl_;
  const std::size_t q = impl.data.free.size();
  const auto found = std::find(impl.data.free.begin(), impl.data.free.end(), parameter);
  if (found == impl.data.free.end())
    throw std::invalid_argument("profile_fit: the parameter is not a free one");
  const auto at = static_cast<std::size_t>(found - impl.data.free.begin());
  // Variance of an observation as it counts for this parameter, including Rao's factors and the
  // error of the excitation.
  const double variance =
      impl.fit.covariance[at * q + at] / impl.inference.inverse_gram()[at * q + at];
  if (!(variance > 0.0)) return std::nullopt;
  const double tolerance = impl.data.options.tolerance;
  impl.kept = impl.fit;
  const auto penalised = [&](const Fit& fit, double sum) {
    return sum + (impl.data.priors ? impl.data.prior_sum(fit.theta) * variance : 0.0);
  };
  const double best = penalised(impl.kept, impl.kept.sum_of_squares);
  impl.equations.pinned[at] = 1;
  impl.fit.theta = theta;
  impl.fit.status = FitStatus::not_converged;
  // The sum of squares is flat at its optimum: an error of theta of 1e-3 standard errors changes it
  // by 1e-6 of a variance.
  impl.data.options.tolerance =
      std::clamp(1e-3 * impl.kept.standard_error[static_cast<std::size_t>(parameter)] /
                     std::max(std::fabs(theta[static_cast<std::size_t>(parameter)]), 1e-12),
                 1e-9, 1e-4);
  if (!impl.lifted.run(true)) {
    impl.fit.theta = theta;
    impl.nested.run(theta, true, true);
  }
  impl.equations.pinned[at] = 0;
  impl.data.options.tolerance = tolerance;
  std::optional<double> excess;
  if (impl.fit.status == FitStatus::converged) {
    const double sum = impl.inference.residual_sum() + impl.data.total_scatter;
    excess = (penalised(impl.fit, sum) - best) / variance;
    theta = impl.fit.theta;
  }
  std::swap(impl.fit, impl.kept);
  return excess;
}

void Estimator::extrapolate_states(const std::vector<double>& change) {
  for (PeriodicSystem& system : impl_->solutions.systems)
    system.advance(0.0, change);
}

void Estimator::restore_solutions() {
  std::string trouble = impl_->solutions.solve_all(impl_->fit.theta, true);
  if (!trouble.empty()) impl_->fit.trouble = std::move(trouble);
}

bool Estimator::linearise_at(const std::vector<double>& theta) {
  const std::vector<double> unchanged(theta.size(), 0.0);
  for (std::size_t r = 0; r < impl_->solutions.systems.size(); ++r) {
    PeriodicSystem& system = impl_->solutions.systems[r];
    if (system.solve(theta).status != SolveStatus::converged) return false;
    // Takes the last Newton step as well, because second differences would show its remainder.
    system.advance(1.0, unchanged);
  }
  return true;
}

double Estimator::unit_noise() const {
  if (impl_->data.covariances) return 1.0;
  return impl_->data.options.noise > 0.0 ? impl_->data.options.noise : impl_->fit.noise;
}

void Estimator::start_from(const Estimator& other) {
  for (std::size_t r = 0; r < impl_->solutions.systems.size(); ++r)
    impl_->solutions.systems[r].interpolate_from(other.impl_->solutions.systems.at(r));
}

const Fit& Estimator::last() const {
  return impl_->fit;
}
const std::vector<PeriodicSystem>& Estimator::solutions() const {
  return impl_->solutions.systems;
}

std::vector<double> Estimator::predicted(std::size_t run) const {
  const RunState& state = impl_->data.runs.at(run);
  const PeriodicSystem& system = impl_->solutions.systems[run];
  std::vector<double> y;
  if (state.harmonic()) {
    for (int i = 0; i < system.points(); ++i)
      y.push_back(system.observed(i));
    return fourier_coefficients(y, state.whitened.size());
  }
  for (const GridReading& reading : state.readings) {
    double sum = 0.0;
    for (int k = 0; k < reading.count; ++k)
      sum += reading.weight[k] * system.observed((reading.base + k) % system.points());
    y.push_back(sum);
  }
  return y;
}

Linearised Estimator::linearised() const {
  const Impl& impl = *impl_;
  Linearised out;
  for (std::size_t r = 0; r < impl.data.runs.size(); ++r) {
    impl.data.for_each_datum(r, impl.solutions.systems[r], false,
                             [&](const double* row, double residual, double weight) {
                               const double root = std::sqrt(weight);
                               out.residual.push_back(root * residual);
                               for (std::size_t k = 1; k <= impl.fit.theta.size(); ++k)
                                 out.jacobian.push_back(root * row[k]);
                               out.run.push_back(static_cast<int>(r));
                             });
  }
  return out;
}

}  // namespace shaker::estimator
