#include "estimator/diagnosis/cycles/internal/whole_cycles.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/math/harmonic_basis.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// Cyclic times of one cycle's samples; empty when too many are missing.
std::vector<double> cyclic_times(const Recording& run, const PhaseFit& phase,
                                 const WholeCycles& cycles, std::size_t k, int harmonics) {
  std::vector<double> tau;
  double gap = 0.0;
  for (std::size_t i = cycles.first[k]; i < cycles.last[k]; ++i) {
    tau.push_back(phase.turn(run.t[i]) - cycles.start[k]);
    if (tau.size() > 1) gap = std::max(gap, tau.back() - tau[tau.size() - 2]);
  }
  if (static_cast<double>(tau.size()) < 0.9 * cycles.samples || gap > 0.5 / harmonics) tau.clear();
  return tau;
}

Eigen::MatrixXd basis_at(const std::vector<double>& tau, int harmonics) {
  const auto size = static_cast<std::size_t>(harmonic_size(harmonics));
  Eigen::MatrixXd rows(harmonic_size(harmonics), static_cast<Eigen::Index>(tau.size()));
  for (std::size_t i = 0; i < tau.size(); ++i)
    fill_harmonic_row(tau[i], {rows.col(static_cast<Eigen::Index>(i)).data(), size});
  return rows.transpose();
}

}  // namespace

WholeCycles whole_cycles(const Recording& run, const PhaseFit& phase) {
  WholeCycles all;
  const double first = std::ceil(phase.turn(phase.from) - 1e-9);
  std::vector<std::size_t> counts;
  for (double turn = first; phase.turn(phase.to) + 1e-9 >= turn + 1.0; turn += 1.0) {
    const auto at = [&](double wanted) {
      const double t = (wanted - phase.offset) / phase.frequency_hz;
      return static_cast<std::size_t>(std::lower_bound(run.t.begin(), run.t.end(), t) -
                                      run.t.begin());
    };
    all.first.push_back(at(turn - 1e-9));
    all.last.push_back(at(turn + 1.0 - 1e-9));
    all.start.push_back(turn);
    counts.push_back(all.last.back() - all.first.back());
  }
  if (counts.empty()) return all;
  std::sort(counts.begin(), counts.end());
  all.samples = static_cast<double>(counts[counts.size() / 2]);
  return all;
}

std::vector<std::size_t> fit_cycles(const Recording& run, const PhaseFit& phase,
                                    const WholeCycles& cycles, int harmonics,
                                    const std::vector<CycleChannel>& channels) {
  std::vector<std::size_t> fitted;
  const double step = (run.t.back() - run.t.front()) / static_cast<double>(run.t.size() - 1);
  const double samples = 1.0 / (step * phase.frequency_hz);  // need not be a whole number
  std::vector<LeftByHarmonics> left(channels.size(), LeftByHarmonics(samples, harmonics));
  for (const CycleChannel& channel : channels)
    channel.rows->conservativeResize(static_cast<Eigen::Index>(cycles.count()), Eigen::NoChange);
  for (std::size_t k = 0; k < cycles.count(); ++k) {
    const std::vector<double> tau = cyclic_times(run, phase, cycles, k, harmonics);
    if (tau.empty()) continue;
    const Eigen::MatrixXd basis = basis_at(tau, harmonics);
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(basis.cols(), basis.cols());
    add_gram(normal, basis);
    const Cholesky factor(normal);
    if (!factor.positive()) continue;
    bool finite = true;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const CycleChannel& channel = channels[c];
      const Eigen::Map<const Eigen::VectorXd> values(&(*channel.samples)[cycles.first[k]],
                                                     basis.rows());
      const Eigen::VectorXd curve = factor.solve(Eigen::VectorXd(basis.transpose() * values));
      finite = finite && curve.allFinite();
      channel.rows->row(static_cast<Eigen::Index>(fitted.size())) =
          curve.head(channel.rows->cols());
      if (channel.sampling != nullptr) left[c].add(tau, values - basis * curve);
    }
    if (finite) fitted.push_back(k);
  }
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const CycleChannel& channel = channels[c];
    channel.rows->conservativeResize(static_cast<Eigen::Index>(fitted.size()), Eigen::NoChange);
    if (channel.sampling != nullptr) *channel.sampling = left[c].sampling();
  }
  return fitted;
}

}  // namespace shaker::estimator::diagnosis
