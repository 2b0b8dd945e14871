#include "estimator/fit/estimation.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/fit/estimation_impl.hpp"
#include "estimator/fit/harmonic_data.hpp"

namespace shaker::estimator {

Estimator::Estimator(const Model& model, std::vector<RunData> runs, EstimationOptions options)
    : impl_(std::make_unique<Impl>(model, std::move(runs), options)) {}
Estimator::~Estimator() = default;
Estimator::Estimator(Estimator&&) noexcept = default;
Estimator& Estimator::operator=(Estimator&&) noexcept = default;

void Estimator::update_run(std::size_t run, const RunData& data) {
  RunState& state = impl_->runs.at(run);
  if (data.displacement.size() != state.data.displacement.size() ||
      data.excitation.size() != state.data.excitation.size() ||
      data.tau.size() != state.data.tau.size() ||
      data.sample_weight.size() != state.data.sample_weight.size() ||
      data.harmonics.size() != state.data.harmonics.size() || data.periods != state.data.periods)
    throw std::invalid_argument("update_run: the data have another shape than the run");
  check_run(data, run);
  state.data = data;
  impl_->load(run);
  for (RunPack& pack : impl_->packs) {
    if (std::find(pack.runs.begin(), pack.runs.end(), run) != pack.runs.end())
      impl_->load_pack(pack);
  }
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
  const bool lifted = impl.options.method == Method::lifted;
  fit.nested = !lifted || !impl.fit_lifted(warm);
  if (fit.nested) {
    fit.theta = start;
    fit.iterates.clear();
    impl.fit_nested(start, warm && !lifted, impl.options.method != Method::gauss_newton);
  }
  if (!warm && impl.options.method != Method::gauss_newton &&
      (fit.status == FitStatus::not_converged || impl.fits_badly()))
    impl.refit_on_data_branch(start);
  impl.finish();
  return fit;
}

std::optional<double> Estimator::profile_fit(int parameter, std::vector<double>& theta) {
  Impl& impl = *impl_;
  const std::size_t q = impl.free.size();
  const auto found = std::find(impl.free.begin(), impl.free.end(), parameter);
  if (found == impl.free.end())
    throw std::invalid_argument("profile_fit: the parameter is not a free one");
  const auto at = static_cast<std::size_t>(found - impl.free.begin());
  // Variance of an observation as it counts for this parameter, including Rao's factors and the
  // error of the excitation.
  const double variance = impl.fit.covariance[at * q + at] / impl.inverse_gram[at * q + at];
  if (!(variance > 0.0)) return std::nullopt;
  const double tolerance = impl.options.tolerance;
  impl.kept = impl.fit;
  const auto penalised = [&](const Fit& fit, double sum) {
    return sum + (impl.priors ? impl.prior_sum_at(fit.theta) * variance : 0.0);
  };
  const double best = penalised(impl.kept, impl.kept.sum_of_squares);
  impl.pinned[at] = 1;
  impl.fit.theta = theta;
  impl.fit.status = FitStatus::not_converged;
  // The sum of squares is flat at its optimum: an error of theta of 1e-3 standard errors changes it
  // by 1e-6 of a variance.
  impl.options.tolerance =
      std::clamp(1e-3 * impl.kept.standard_error[static_cast<std::size_t>(parameter)] /
                     std::max(std::fabs(theta[static_cast<std::size_t>(parameter)]), 1e-12),
                 1e-9, 1e-4);
  if (!impl.fit_lifted(true)) {
    impl.fit.theta = theta;
    impl.fit_nested(theta, true, true);
  }
  impl.pinned[at] = 0;
  impl.options.tolerance = tolerance;
  std::optional<double> excess;
  if (impl.fit.status == FitStatus::converged) {
    const double sum = impl.residual_sum() + impl.total_scatter;
    excess = (penalised(impl.fit, sum) - best) / variance;
    theta = impl.fit.theta;
  }
  std::swap(impl.fit, impl.kept);
  return excess;
}

void Estimator::extrapolate_states(const std::vector<double>& change) {
  for (PeriodicSystem& system : impl_->systems)
    system.advance(0.0, change);
}

void Estimator::restore_solutions() {
  impl_->solve_all(true);
}

bool Estimator::linearise_at(const std::vector<double>& theta) {
  const std::vector<double> unchanged(theta.size(), 0.0);
  for (std::size_t r = 0; r < impl_->systems.size(); ++r) {
    PeriodicSystem& system = impl_->systems[r];
    if (system.solve(theta).status != SolveStatus::converged) return false;
    // Takes the last Newton step as well, because second differences would show its remainder.
    system.advance(1.0, unchanged);
  }
  return true;
}

double Estimator::unit_noise() const {
  if (impl_->covariances) return 1.0;
  return impl_->options.noise > 0.0 ? impl_->options.noise : impl_->fit.noise;
}

void Estimator::start_from(const Estimator& other) {
  for (std::size_t r = 0; r < impl_->systems.size(); ++r)
    impl_->systems[r].interpolate_from(other.impl_->systems.at(r));
}

const Fit& Estimator::last() const {
  return impl_->fit;
}
const std::vector<PeriodicSystem>& Estimator::solutions() const {
  return impl_->systems;
}

std::vector<double> Estimator::predicted(std::size_t run) const {
  const RunState& state = impl_->runs.at(run);
  const PeriodicSystem& system = impl_->systems[run];
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
  for (std::size_t r = 0; r < impl.runs.size(); ++r) {
    impl.for_each_datum(r, false, [&](const double* row, double residual, double weight) {
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
