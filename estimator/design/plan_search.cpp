#include "estimator/design/internal/plan_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace shaker::estimator {
namespace {

constexpr int kGreedyStarts = 6;
// Shares of the rig time that are moved from one run to another: the next is tried where the last
// helps no more.
constexpr double kMovedShares[] = {0.2, 0.08, 0.03, 0.01};

// Replaces one run at a time by the best other one until no exchange helps. A run may occur
// twice, which means twice as many cycles of it.
void exchange(std::vector<std::size_t>& runs, const std::vector<std::size_t>& possible,
              const Criterion& criterion) {
  double best = criterion(equally(runs));
  for (bool better = true; better;) {
    better = false;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const std::size_t before = runs[i];
      std::size_t chosen = before;
      for (const std::size_t other : possible) {
        runs[i] = other;
        const double value = criterion(equally(runs));
        if (value < best - 1e-12 * std::fabs(best)) {
          best = value;
          chosen = other;
          better = true;
        }
      }
      runs[i] = chosen;
    }
  }
  std::sort(runs.begin(), runs.end());
}

}  // namespace

std::vector<std::vector<std::size_t>> best_sets(int size, int keep,
                                                const std::vector<std::size_t>& possible,
                                                const Criterion& criterion) {
  std::vector<std::size_t> singles = possible;
  std::sort(singles.begin(), singles.end(), [&](std::size_t a, std::size_t b) {
    return criterion(equally({a})) < criterion(equally({b}));
  });
  std::map<std::vector<std::size_t>, double> found;
  for (std::size_t s = 0; s < std::min<std::size_t>(singles.size(), kGreedyStarts); ++s) {
    std::vector<std::size_t> runs = {singles[s]};
    while (static_cast<int>(runs.size()) < size) {
      runs.push_back(possible.front());
      double best = std::numeric_limits<double>::infinity();
      std::size_t chosen = possible.front();
      for (const std::size_t other : possible) {
        runs.back() = other;
        const double value = criterion(equally(runs));
        if (value < best) {
          best = value;
          chosen = other;
        }
      }
      runs.back() = chosen;
    }
    exchange(runs, possible, criterion);
    found[runs] = criterion(equally(runs));
  }
  const auto optima = found;
  for (const auto& entry : optima) {
    for (std::size_t i = 0; i < entry.first.size(); ++i) {
      for (const std::size_t other : possible) {
        std::vector<std::size_t> runs = entry.first;
        runs[i] = other;
        std::sort(runs.begin(), runs.end());
        found[runs] = criterion(equally(runs));
      }
    }
  }
  std::vector<std::pair<double, std::vector<std::size_t>>> ranked;
  for (const auto& entry : found)
    ranked.emplace_back(entry.second, entry.first);
  std::sort(ranked.begin(), ranked.end());
  std::vector<std::vector<std::size_t>> out;
  for (const auto& entry : ranked) {
    if (static_cast<int>(out.size()) >= keep) break;
    out.push_back(entry.second);
  }
  return out;
}

RunShares best_shares(std::vector<std::size_t> runs, const Criterion& criterion) {
  RunShares set = equally(std::move(runs));
  double best = criterion(set);
  const auto try_move = [&](std::size_t from, std::size_t to, double moved) {
    if (from == to || set.share[from] <= moved) return false;
    RunShares other = set;
    other.share[from] -= moved;
    other.share[to] += moved;
    const double value = criterion(other);
    if (!(value < best - 1e-9)) return false;
    best = value;
    set = std::move(other);
    return true;
  };
  for (const double moved : kMovedShares) {
    for (bool better = true; better;) {
      better = false;
      for (std::size_t from = 0; from < set.runs.size(); ++from) {
        for (std::size_t to = 0; to < set.runs.size(); ++to)
          better = try_move(from, to, moved) || better;
      }
    }
  }
  return set;
}

}  // namespace shaker::estimator
