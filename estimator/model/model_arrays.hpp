// The arrays that Model::evaluate reads and fills, as slices of one store.
#pragma once

#include <cstddef>
#include <vector>

#include "estimator/math/aligned.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator {

struct PointArrays {
  std::vector<double*>&u, &v, &a, &g, &g_u, &g_v, &g_a, &g_theta, &scratch;
};

inline std::size_t point_arrays(const Model& model) {
  const int s = model.coordinates();
  return static_cast<std::size_t>(4 * s + 3 * s * s + s * model.parameter_count() +
                                  model.scratch_arrays());
}

// Appends point_arrays() arrays to the lists of `out`: the first at `first`, each `apart`
// doubles after the previous one.
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

// Owns such arrays, for callers without a layout of their own. `x` is the excitation.
struct ModelArrays {
  AlignedVector store;
  std::vector<double*> u, v, a, g, g_u, g_v, g_a, g_theta, scratch;
  double* x = nullptr;

  // Allocates arrays of at least `points` values, all zero.
  void shape(const Model& model, int points) {
    const auto apart = (static_cast<std::size_t>(points) + 7) / 8 * 8;
    store.assign(apart * (point_arrays(model) + 1), 0.0);
    for (std::vector<double*>* list : {&u, &v, &a, &g, &g_u, &g_v, &g_a, &g_theta, &scratch})
      list->clear();
    cut_point_arrays(model, store.data() + apart, static_cast<std::ptrdiff_t>(apart),
                     {u, v, a, g, g_u, g_v, g_a, g_theta, scratch});
    x = store.data();
  }

  // Evaluates the first n points. Returns false if the model is inadmissible at one of them.
  bool evaluate(const Model& model, int n, const double* theta) const {
    return evaluate(model, n, theta, x);
  }
  bool evaluate(const Model& model, int n, const double* theta, const double* excitation) const {
    return model.evaluate(first_points(n, excitation), theta, outputs(g_theta.data()));
  }
  // With stroke and velocity from elsewhere, which may be these arrays. g_theta may stay as it is
  // where `slopes` is false.
  bool evaluate(const Model& model, int n, const double* theta, const double* excitation,
                const double* const* stroke, const double* const* velocity,
                bool slopes = true) const {
    ModelPoints at = first_points(n, excitation);
    at.u = stroke;
    at.v = velocity;
    const bool needed = slopes || model.coordinates() == 1;
    return model.evaluate(at, theta, outputs(needed ? g_theta.data() : nullptr));
  }
  // Evaluates the internal coordinates' equations at the first n points, without g_theta.
  bool evaluate_internal(const Model& model, int n, const double* theta) const {
    return model.evaluate_internal(first_points(n, x), theta, outputs(nullptr));
  }

 private:
  ModelPoints first_points(int n, const double* excitation) const {
    ModelPoints at;
    at.n = n;
    at.u = u.data();
    at.v = v.data();
    at.a = a.data();
    at.x = excitation;
    return at;
  }
  ModelForces outputs(double* const* over_theta) const {
    return {g.data(), g_u.data(), g_v.data(), g_a.data(), over_theta, scratch.data()};
  }
};

}  // namespace shaker::estimator
