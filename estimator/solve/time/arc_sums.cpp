#include <algorithm>

#include "estimator/solve/time/integration.hpp"

namespace shaker::estimator {

// From what run() keeps.
IntegrationReport TimeIntegration::sums(std::span<Arc> arcs, std::span<const double> theta,
                                        const SumOptions&, ArcSums& out) {
  const IntegrationReport report = run(arcs, theta, true);
  if (!report.ok) return report;
  const auto seen = static_cast<std::size_t>(equations_.model().observed());
  const std::size_t m = out.states = static_cast<std::size_t>(equations_.states());
  const std::size_t k = out.columns = arcs[0].sensitivities.size() / (arcs[0].times.size() * m);
  out.numbers.assign(arcs.size() * out.size(), 0.0);
  std::vector<double> row(k + 1);
  for (std::size_t a = 0; a < arcs.size(); ++a) {
    const Arc& arc = arcs[a];
    std::copy_n(arc.states.end() - static_cast<std::ptrdiff_t>(m), m, out.end(a));
    std::copy_n(arc.sensitivities.end() - static_cast<std::ptrdiff_t>(m * k), m * k,
                out.derivatives(a));
    double* products = out.products(a);
    for (std::size_t i = 0; i < arc.measured.size(); ++i) {
      const std::size_t node = arc.first_measured + i;
      std::copy_n(&arc.sensitivities[(node * m + seen) * k], k, row.data());
      row[k] = arc.measured[i] - arc.states[node * m + seen];
      for (std::size_t r = 0; r <= k; ++r) {
        for (std::size_t c = 0; c <= k; ++c)
          products[r * (k + 1) + c] += row[r] * row[c];
      }
    }
  }
  return report;
}

}  // namespace shaker::estimator
