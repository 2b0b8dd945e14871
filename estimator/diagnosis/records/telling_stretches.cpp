#include "estimator/diagnosis/records/internal/telling_stretches.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "estimator/diagnosis/records/internal/transient_cosines.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;

constexpr int kStretches = 3;
constexpr double kAsLively = 0.8;  // of a stretch's power: another one that says as much
constexpr double kStill = 1e-3;    // of the largest power: below it a stretch hardly moves

}  // namespace

std::vector<Stretch> telling_stretches(const Eigen::VectorXd& moves, double share) {
  const Index length =
      fast_length(static_cast<Index>(share / kStretches * static_cast<double>(moves.size())));
  std::vector<std::pair<double, Index>> power;  // of a stretch, and its first sample
  for (Index at = 0; at + length <= moves.size(); at += std::max<Index>(1, length / 2)) {
    const auto part = moves.segment(at, length).array();
    power.emplace_back((part - part.mean()).square().mean(), at);
  }
  auto sorted = power;
  std::sort(sorted.rbegin(), sorted.rend());
  const double most = sorted.front().first;
  const auto moving = static_cast<std::size_t>(
      std::count_if(power.begin(), power.end(), [&](auto s) { return s.first >= kStill * most; }));
  std::vector<Stretch> stretches;
  for (const std::size_t rank : {std::size_t{0}, moving / 2, moving - 1}) {
    const double wanted = sorted[rank].first;
    // The first of those, half a length apart, that have nearly this power.
    for (const auto& one : power) {
      const double size = one.first;
      const Index at = one.second;
      const bool apart = std::all_of(stretches.begin(), stretches.end(), [&](const Stretch& other) {
        return std::abs(at - other.begin) >= length;
      });
      if (apart && size >= kAsLively * wanted && kAsLively * size <= wanted) {
        stretches.push_back({at, length});
        break;
      }
    }
  }
  std::sort(stretches.begin(), stretches.end(),
            [](const Stretch& a, const Stretch& b) { return a.begin < b.begin; });
  return stretches;
}

}  // namespace shaker::estimator::diagnosis
