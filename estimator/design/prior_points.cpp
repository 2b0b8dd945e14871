#include "estimator/design/prior_points.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/design/internal/plan_candidates.hpp"
#include "estimator/math/parallel.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator {
namespace {

constexpr int kPriorPoints = 12;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

// The Weyl sequence of the generalised golden ratio, which is even in several dimensions.
double golden_ratio(std::size_t dimensions) {
  double root = 1.5;
  for (int i = 0; i < 60; ++i)
    root = std::pow(1.0 + root, 1.0 / static_cast<double>(dimensions + 1));
  return root;
}

// A damper of the prior, and which runs the rig can do with it.
struct Damper {
  PlanPoint point;
  std::vector<char> possible;
  std::ptrdiff_t runs() const { return std::count(possible.begin(), possible.end(), 1); }
};

std::size_t shared_runs(const std::vector<Damper>& dampers, std::size_t all) {
  std::size_t shared = 0;
  for (std::size_t i = 0; i < all; ++i)
    shared += std::all_of(dampers.begin(), dampers.end(),
                          [&](const Damper& d) { return d.possible[i] != 0; });
  return shared;
}

}  // namespace

std::size_t leave_out_impossible(const Model& model, PlanOptions& options) {
  std::vector<PlanCandidate> runs = grid_of(options);
  const std::vector<double> nominal = point_of(model, options);
  std::erase_if(
      runs, [&](const PlanCandidate& run) { return !possible_at(model, options, nominal, run); });
  const std::size_t before = options.prior.size(), count = runs.size();
  if (runs.empty()) {  // no plan, whatever the prior is
    options.prior.clear();
    return before;
  }
  std::vector<Damper> dampers;
  for (PlanPoint& point : options.prior)
    dampers.push_back({std::move(point), std::vector<char>(count, 0)});
  in_parallel(
      static_cast<long>(before), options.threads, [] { return 0; },
      [&](int, long d) {
        Damper& damper = dampers[static_cast<std::size_t>(d)];
        for (std::size_t i = 0; i < count; ++i)
          damper.possible[i] = possible_at(model, options, damper.point.theta, runs[i]) ? 1 : 0;
      },
      1);
  std::erase_if(dampers, [](const Damper& damper) { return damper.runs() == 0; });
  const std::size_t wanted = std::min(count, static_cast<std::size_t>(options.most_runs));
  while (shared_runs(dampers, count) < wanted)
    dampers.erase(
        std::min_element(dampers.begin(), dampers.end(),
                         [](const Damper& a, const Damper& b) { return a.runs() < b.runs(); }));
  options.prior.clear();
  for (Damper& damper : dampers)
    options.prior.push_back(std::move(damper.point));
  return before - dampers.size();
}

std::vector<std::vector<double>> prior_points(const Model& model, double spread) {
  const std::vector<double> start = model.start();
  std::vector<std::size_t> uncertain;
  std::vector<double> mean = start, deviation(start.size(), 0.0);
  for (std::size_t k = 0; k < start.size(); ++k) {
    const ModelParameter& p = model.parameters()[k];
    if (p.fixed) continue;
    mean[k] = p.prior_mean.value_or(start[k]);
    deviation[k] = p.prior_standard_deviation.value_or(spread * std::fabs(start[k]));
    if (deviation[k] > 0.0) uncertain.push_back(k);
  }
  std::vector<std::vector<double>> points;
  if (uncertain.empty()) return points;
  const double root = golden_ratio(uncertain.size());
  for (int i = 1; i <= kPriorPoints; ++i) {
    std::vector<double>& theta = points.emplace_back(start);
    for (std::size_t d = 0; d < uncertain.size(); ++d) {
      const std::size_t k = uncertain[d];
      const double at = 0.5 + i * std::pow(root, -static_cast<double>(d + 1));
      const double share = std::clamp(at - std::floor(at), 1e-3, 1.0 - 1e-3);
      const ModelParameter& p = model.parameters()[k];
      theta[k] = std::clamp(mean[k] + deviation[k] * student_t_quantile(share, kInfinite), p.lower,
                            p.upper);
    }
  }
  return points;
}

}  // namespace shaker::estimator
