#include "estimator/solve/time/internal/lane_block.hpp"

#include <algorithm>

namespace shaker::estimator {

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

}  // namespace shaker::estimator
