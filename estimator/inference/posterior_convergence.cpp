#include "estimator/inference/internal/posterior_convergence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "estimator/math/statistics.hpp"

namespace shaker::estimator {
namespace {

using Chains = std::vector<std::vector<double>>;

double mean_of(const std::vector<double>& x) {
  return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

Chains halves(const Chains& chains) {
  Chains out;
  for (const auto& chain : chains) {
    const auto half = static_cast<std::ptrdiff_t>(chain.size() / 2);
    out.emplace_back(chain.begin(), chain.begin() + half);
    out.emplace_back(chain.end() - half, chain.end());
  }
  return out;
}

std::vector<double> pooled(const Chains& chains) {
  std::vector<double> all;
  for (const auto& chain : chains)
    all.insert(all.end(), chain.begin(), chain.end());
  return all;
}

// Replaces each value by the normal quantile of its rank among all; ties share the mean rank.
Chains normal_scores(const Chains& chains) {
  const std::vector<double> all = pooled(chains);
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return all[a] < all[b]; });
  std::vector<double> score(all.size());
  const auto count = static_cast<double>(all.size());
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    while (last + 1 < order.size() && !(all[order[last + 1]] > all[order[first]]))
      ++last;
    const double rank = 0.5 * static_cast<double>(first + last) + 1.0;
    const double z = student_t_quantile((rank - 0.375) / (count + 0.25),
                                        std::numeric_limits<double>::infinity());
    for (; first <= last; ++first)
      score[order[first]] = z;
  }
  Chains out = chains;
  auto next = score.begin();
  for (auto& chain : out) {
    for (double& value : chain)
      value = *next++;
  }
  return out;
}

double plain_r_hat(const Chains& chains) {
  const auto n = static_cast<double>(chains.front().size());
  const auto m = static_cast<double>(chains.size());
  double grand = 0.0, within = 0.0, between = 0.0;
  for (const auto& chain : chains)
    grand += mean_of(chain) / m;
  for (const auto& chain : chains) {
    const double mean = mean_of(chain);
    between += (mean - grand) * (mean - grand) / (m - 1.0);
    for (const double x : chain)
      within += (x - mean) * (x - mean) / ((n - 1.0) * m);
  }
  return within > 0.0 ? std::sqrt((n - 1.0) / n + between / within)
                      : std::numeric_limits<double>::infinity();
}

}  // namespace

double split_r_hat(const Chains& chains) {
  const Chains split = halves(chains);
  std::vector<double> all = pooled(split);
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2),
                   all.end());
  const double median = all[all.size() / 2];
  Chains folded = split;
  for (auto& chain : folded) {
    for (double& x : chain)
      x = std::fabs(x - median);
  }
  return std::max(plain_r_hat(normal_scores(split)), plain_r_hat(normal_scores(folded)));
}

double effective_of_chains(const Chains& chains, double variance) {
  const std::size_t n = chains.front().size();
  const auto m = static_cast<double>(chains.size());
  std::vector<double> mean;
  for (const auto& chain : chains)
    mean.push_back(mean_of(chain));
  const double grand = mean_of(mean);
  double between = 0.0;
  for (const double one : mean)
    between += (one - grand) * (one - grand) / (m - 1.0);
  const auto autocovariance = [&](std::size_t lag) {
    double sum = 0.0;
    for (std::size_t c = 0; c < chains.size(); ++c) {
      for (std::size_t t = 0; t + lag < n; ++t)
        sum += (chains[c][t] - mean[c]) * (chains[c][t + lag] - mean[c]);
    }
    return sum / (static_cast<double>(n) * m);
  };
  const double within = autocovariance(0) * static_cast<double>(n) / (static_cast<double>(n) - 1.0);
  const double whole = autocovariance(0) + between;
  if (!(whole > 0.0)) return 0.0;
  const auto correlation = [&](std::size_t lag) {
    return 1.0 - (within - autocovariance(lag)) / whole;
  };
  // Geyer: sums of neighbouring correlations are positive and do not increase.
  double sum = 1.0 + correlation(1), before = sum;
  for (std::size_t lag = 2; lag + 1 < n; lag += 2) {
    const double pair = std::min(correlation(lag) + correlation(lag + 1), before);
    if (!(pair > 0.0)) break;
    sum += pair;
    before = pair;
  }
  const double time = std::max(2.0 * sum - 1.0, 1.0 / std::log10(m * static_cast<double>(n)));
  return variance / (whole * time / (m * static_cast<double>(n)));
}

}  // namespace shaker::estimator
