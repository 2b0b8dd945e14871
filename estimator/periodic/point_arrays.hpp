// The arrays of points that Model::evaluate reads and fills, cut out of one store.
#pragma once

#include <cstddef>
#include <vector>

#include "estimator/model.hpp"

namespace shaker::estimator {

struct PointArrays {
  std::vector<double*>&u, &v, &a, &g, &g_u, &g_v, &g_a, &g_theta, &scratch;
};

inline std::size_t point_arrays(const Model& model) {
  const int s = model.coordinates();
  return static_cast<std::size_t>(4 * s + 3 * s * s + s * model.parameter_count() +
                                  model.scratch_arrays());
}

// point_arrays() of them, the first at `first`, each `apart` doubles after the one before.
inline void cut_point_arrays(const Model& model, double* first, std::ptrdiff_t apart,
                             const PointArrays& out) {
  const auto take = [&](std::vector<double*>& list, int count) {
    for (int i = 0; i < count; ++i, first += apart)
      list.push_back(first);
  };
  const int s = model.coordinates();
  for (std::vector<double*>* list : {&out.u, &out.v, &out.a, &out.g})
    take(*list, s);
  for (std::vector<double*>* list : {&out.g_u, &out.g_v, &out.g_a})
    take(*list, s * s);
  take(out.g_theta, s * model.parameter_count());
  take(out.scratch, model.scratch_arrays());
}

}  // namespace shaker::estimator
