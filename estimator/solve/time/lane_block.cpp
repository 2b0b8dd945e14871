#include "estimator/solve/time/internal/lane_block.hpp"

#include <algorithm>

namespace shaker::estimator {

std::vector<int> followed_states(const StateEquations& equations) {
  std::vector<int> follows(static_cast<std::size_t>(equations.states()), -1);
  for (int e = 0; e < equations.coordinates(); ++e)
    follows[static_cast<std::size_t>(e)] = equations.velocity_of(e);
  return follows;
}

void LaneBlock::shape(int lanes, std::size_t m, std::size_t k, const std::vector<int>& follows,
                      const std::vector<int>& free, std::size_t p) {
  n = lanes;
  stride = (static_cast<std::size_t>(lanes) + 7) / 8 * 8;
  components = m * (1 + k);
  const std::size_t derivatives = k > 0 ? kClassicStages * (m * m + m * p) : 0;
  numbers.assign(stride * (2 * components + 3 * m + derivatives + 4) + (k > 0 ? 72 * m * m : 0),
                 0.0);
  double* at = numbers.data();
  const auto take = [&](std::size_t count) {
    double* first = at;
    at += count * stride;
    return first;
  };
  const auto list = [&](std::vector<double*>& arrays, std::size_t count, double* first) {
    arrays.resize(count);
    for (std::size_t i = 0; i < count; ++i)
      arrays[i] = first + i * stride;
  };
  step.stride = static_cast<int>(stride);
  step.states = static_cast<int>(m);
  step.columns = static_cast<int>(k);
  step.y = take(components);
  step.base = take(components);
  step.sum = take(m);
  step.follows = follows.data();
  list(y, m, step.y);
  list(base, m, step.base);
  list(rate, m, take(m));
  for (std::size_t i = 0; i < m; ++i) {
    if (follows[i] >= 0) rate[i] = nullptr;
  }
  list(first_rate, m, take(m));
  for (std::size_t stage = 0; stage < kClassicStages && k > 0; ++stage) {
    if (stage == 0) slopes = at;
    list(h_s[stage], m * m, take(m * m));
    list(h_theta[stage], m * p, take(m * p));
    columns[stage].clear();
    for (std::size_t i = 0; i < m; ++i) {
      for (const int parameter : free)
        columns[stage].push_back(h_theta[stage][i * p + static_cast<std::size_t>(parameter)]);
    }
    for (std::size_t i = 0; i < m; ++i) {
      if (follows[i] < 0) continue;
      std::fill_n(h_s[stage].begin() + static_cast<std::ptrdiff_t>(i * m), m, nullptr);
      std::fill_n(h_theta[stage].begin() + static_cast<std::ptrdiff_t>(i * p), p, nullptr);
    }
    step.h_s[stage] = h_s[stage].data();
    step.h_theta[stage] = columns[stage].data();
  }
  step.rate = rate.data();
  for (double** array : {&h, &x_middle, &x_end, &measured})
    *array = take(1);
  step.h = h;
  step.room = at;
}

void LaneBlock::begin(std::span<const Arc> arcs) {
  const std::size_t m = y.size(), k = components / m - 1;
  std::fill_n(step.y, components * stride, 0.0);
  for (std::size_t lane = 0; lane < static_cast<std::size_t>(n); ++lane) {
    for (std::size_t j = 0; j < m; ++j) {
      y[j][lane] = arcs[lane].start[j];
      if (k > 0) component(step.y, m + j * k + j)[lane] = 1.0;
    }
  }
}

void LaneBlock::write(std::span<Arc> arcs, std::size_t node) const {
  const std::size_t m = y.size(), k = components / m - 1;
  for (std::size_t lane = 0; lane < static_cast<std::size_t>(n); ++lane) {
    Arc& arc = arcs[lane];
    if (node >= arc.times.size()) continue;
    for (std::size_t j = 0; j < m; ++j)
      arc.states[node * m + j] = y[j][lane];
    double* to = k > 0 ? &arc.sensitivities[node * m * k] : nullptr;
    for (std::size_t c = 0; c < m * k; ++c)
      to[c] = component(step.y, m + c)[lane];
  }
}

}  // namespace shaker::estimator
