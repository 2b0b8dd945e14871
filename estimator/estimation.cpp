#include "estimator/estimation.hpp"

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/estimation_impl.hpp"
#include "estimator/objectives/harmonic_data.hpp"

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
      data.harmonics.size() != state.data.harmonics.size())
    throw std::invalid_argument("update_run: the data have another shape than the run");
  check_run(data, run);
  state.data = data;
  impl_->load(run);
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
  if (!lifted || !impl.fit_lifted(warm)) {
    fit.theta = start;
    fit.iterates.clear();
    impl.fit_nested(start, warm && !lifted, impl.options.method != Method::gauss_newton);
  }
  impl.finish();
  return fit;
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
  for (const Reading& reading : state.readings) {
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
