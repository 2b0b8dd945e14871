#include "estimator/model/instrument/observation.hpp"

#include <algorithm>

namespace shaker::estimator {
namespace {

// The model's output arrays, as slices of a workspace.
ModelForces forces_in(const Model& model, double* const* workspace) {
  const int s = model.coordinates();
  ModelForces forces;
  forces.g = workspace;
  forces.g_u = forces.g + s;
  forces.g_v = forces.g_u + s * s;
  forces.g_a = forces.g_v + s * s;
  forces.g_theta = forces.g_a + s * s;
  forces.scratch = forces.g_theta + s * model.parameter_count();
  return forces;
}

// out += sign * row of the part of the residual that `forces` holds.
void add_row(const Model& model, int n, int row, double sign, const ModelForces& forces,
             const ObservedMotion& out) {
  const int s = model.coordinates();
  const int p = model.parameter_count();
  const auto add = [&](const double* from, double* to) {
    for (int i = 0; i < n; ++i)
      to[i] += sign * from[i];
  };
  add(forces.g[row], out.y);
  for (int c = 0; c < s; ++c) {
    add(forces.g_u[row * s + c], out.y_u[c]);
    add(forces.g_v[row * s + c], out.y_v[c]);
    add(forces.g_a[row * s + c], out.y_a[c]);
  }
  for (int k = 0; k < p; ++k)
    add(forces.g_theta[row * p + k], out.y_theta[k]);
}

// Absolute acceleration of the mass: e x - M u'' of its equation, less the motion of the base.
bool absolute_acceleration(const Model& model, const ModelPoints& at, const double* theta,
                           const ObservedMotion& out, double* const* workspace) {
  const int n = at.n;
  const int row = model.observed();
  const ModelForces forces = forces_in(model, workspace);
  model.true_excitation(at, theta, out.y, out.y_theta, forces.scratch);
  const double e = model.excitation(row);
  for (int i = 0; i < n; ++i)
    out.y[i] *= e;
  for (int k = 0; k < model.parameter_count(); ++k) {
    for (int i = 0; i < n; ++i)
      out.y_theta[k][i] *= e;
  }
  for (int c = 0; c < model.coordinates(); ++c) {
    const double m = model.mass(row, c);
    for (int i = 0; i < n && m != 0.0; ++i)
      out.y[i] -= m * at.a[c][i];
    std::fill_n(out.y_a[c], n, -m);
  }
  if (!model.evaluate_part(Model::Part::base, at, theta, forces)) return false;
  add_row(model, n, row, -1.0, forces, out);
  return true;
}

}  // namespace

int observation_arrays(const Model& model) {
  const int s = model.coordinates();
  return s + 3 * s * s + s * model.parameter_count() + model.scratch_arrays();
}

bool observe_motion(const Model& model, Quantity quantity, const ModelPoints& at,
                    const double* theta, const ObservedMotion& out, double* const* workspace) {
  const int n = at.n;
  const int c = model.observed();
  std::fill_n(out.y, n, 0.0);
  for (int d = 0; d < model.coordinates(); ++d) {
    for (double* const* slopes : {out.y_u, out.y_v, out.y_a})
      std::fill_n(slopes[d], n, 0.0);
  }
  for (int k = 0; k < model.parameter_count(); ++k)
    std::fill_n(out.y_theta[k], n, 0.0);
  const auto read = [&](const double* value, double* slope) {
    std::copy_n(value, n, out.y);
    std::fill_n(slope, n, 1.0);
    return true;
  };
  switch (quantity) {
    case Quantity::displacement:
      return read(at.u[c], out.y_u[c]);
    case Quantity::velocity:
      return read(at.v[c], out.y_v[c]);
    case Quantity::acceleration:
      return read(at.a[c], out.y_a[c]);
    case Quantity::absolute_acceleration:
      return absolute_acceleration(model, at, theta, out, workspace);
    case Quantity::damper_force:
      break;
  }
  const ModelForces forces = forces_in(model, workspace);
  if (!model.evaluate_part(Model::Part::load, at, theta, forces)) return false;
  add_row(model, n, c, 1.0, forces, out);
  return true;
}

}  // namespace shaker::estimator
