#include "estimator/model/effects/effect.hpp"

#include <algorithm>
#include <array>

namespace shaker::estimator {
namespace {

constexpr int kLanes = 8;
constexpr int kBlock = 64;  // number of points of one lane in a block

struct alignas(64) Block {
  std::array<double, kBlock> values{};
};

}  // namespace

unsigned Effect::evaluate_lanes(const Points& at, const double* theta, const double* constants,
                                const Forces& out) const {
  const int p = static_cast<int>(parameters().size());
  if (p > kMostParameters) return 0;
  if (p == 0) return evaluate(at, theta, constants, out) ? (1U << kLanes) - 1 : 0;
  std::array<Block, 3 + 4 + kMostParameters> blocks;
  const std::array<const double*, 3> in{at.u, at.v, at.a};
  std::array<double*, 4 + kMostParameters> results{out.f, out.f_u, out.f_v, out.f_a};
  std::array<double*, kMostParameters> columns{};
  for (int k = 0; k < p; ++k) {
    results[static_cast<std::size_t>(4 + k)] = out.f_theta[k];
    columns[static_cast<std::size_t>(k)] = blocks[static_cast<std::size_t>(7 + k)].values.data();
  }
  Forces local;
  local.f = blocks[3].values.data();
  local.f_u = blocks[4].values.data();
  local.f_v = blocks[5].values.data();
  local.f_a = blocks[6].values.data();
  local.f_theta = columns.data();
  unsigned sound = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    std::array<double, kMostParameters> own{};
    for (int k = 0; k < p; ++k)
      own[static_cast<std::size_t>(k)] = theta[kLanes * k + lane];
    bool admissible = true;
    for (int begin = 0; begin < at.n / kLanes; begin += kBlock) {
      const int count = std::min(kBlock, at.n / kLanes - begin);
      const auto each = [&](std::size_t block, auto move) {
        for (int i = 0; i < count; ++i)
          move(blocks[block].values[static_cast<std::size_t>(i)], (begin + i) * kLanes + lane);
      };
      for (std::size_t k = 0; k < 3; ++k)
        each(k, [&](double& value, int i) { value = in[k][i]; });
      for (std::size_t k = 0; k < 4; ++k)
        each(3 + k, [&](double& value, int i) { value = results[k][i]; });
      Points points;
      points.n = count;
      points.u = blocks[0].values.data();
      points.v = blocks[1].values.data();
      points.a = blocks[2].values.data();
      admissible = evaluate(points, own.data(), constants, local) && admissible;
      for (std::size_t k = 0; k < 4 + static_cast<std::size_t>(p); ++k)
        each(3 + k, [&](double& value, int i) { results[k][i] = value; });
    }
    if (admissible) sound |= 1U << lane;
  }
  return sound;
}

}  // namespace shaker::estimator
