#include "estimator/time/over_periods.hpp"

#include <algorithm>

#include "estimator/time/transient.hpp"

namespace shaker::estimator {
namespace {

constexpr std::size_t kSegmentsInPeriod = 4;
constexpr std::size_t kFewestSamples = 8;  // in a segment, which must determine its initial state

// Converts a run to a record. The first sample is repeated after the last one.
TransientRecord record_of(const RunData& run) {
  const std::size_t n = run.displacement.size();
  const double span = static_cast<double>(run.periods) / run.frequency_hz;
  TransientRecord record;
  record.weight = run.cycles * run.weight;
  for (std::size_t i = 0; i <= n; ++i) {
    const double whole = i < n ? 0.0 : 1.0;
    const double tau =
        run.tau.empty() ? static_cast<double>(i % n) / static_cast<double>(n) : run.tau[i % n];
    record.t.push_back((tau + whole) * span);
    record.displacement.push_back(run.displacement[i % n]);
  }
  if (run.excitation.empty()) {
    record.excitation = Excitation::cosine(run.amplitude, run.frequency_hz);
    return record;
  }
  const std::size_t m = run.excitation.size();
  std::vector<double> t, x;
  for (std::size_t i = 0; i <= 2 * m; ++i) {  // two rounds, because tau may begin anywhere
    t.push_back(static_cast<double>(i) / static_cast<double>(m) * span);
    x.push_back(run.excitation[i % m]);
  }
  record.excitation = Excitation::sampled(t, x);
  return record;
}

}  // namespace

std::optional<std::vector<double>> start_over_periods(const Model& model,
                                                      const std::vector<RunData>& runs,
                                                      const std::vector<double>& start) {
  std::vector<TransientRecord> records;
  TransientOptions options;
  options.time.integrator = Integrator::runge_kutta4;
  for (const RunData& run : runs) {
    if (run.displacement.empty()) return std::nullopt;
    records.push_back(record_of(run));
    const std::size_t period = run.displacement.size() / static_cast<std::size_t>(run.periods);
    options.segment = std::max({options.segment, period / kSegmentsInPeriod, kFewestSamples});
  }
  TransientEstimator segments(model, std::move(records), options);
  const TransientFit& fit = segments.fit(start);
  if (fit.status != FitStatus::converged) return std::nullopt;
  return fit.theta;
}

}  // namespace shaker::estimator
