// The residual of a model and its partial derivatives: the loops over points.
#include <algorithm>

#include "estimator/model.hpp"

namespace shaker::estimator {

bool Model::evaluate(const ModelPoints& at, const double* theta, const ModelForces& out) const {
  return coordinates_ == 1 ? evaluate_one(at, theta, out) : evaluate_many(at, theta, out);
}

// One coordinate: the effects add straight into the output.
bool Model::evaluate_one(const ModelPoints& at, const double* theta, const ModelForces& out) const {
  const int n = at.n;
  double* __restrict g = out.g[0];
  for (int i = 0; i < n; ++i)
    g[i] = mass_[0] * at.a[0][i] - excitation_[0] * at.x[i];
  std::fill_n(out.g_u[0], n, 0.0);
  std::fill_n(out.g_v[0], n, 0.0);
  std::fill_n(out.g_a[0], n, mass_[0]);
  for (const Term& term : terms_) {
    const Points points{n, at.u[0], at.v[0], at.a[0]};
    const Forces forces{out.g[0], out.g_u[0], out.g_v[0], out.g_a[0],
                        out.g_theta + term.first_parameter};
    if (!term.effect->evaluate(points, theta + term.first_parameter, term.constants.data(), forces))
      return false;
  }
  return true;
}

// Several: each effect sees a combination of coordinates; its force and slopes are spread over the
// equations in which it stands.
bool Model::evaluate_many(const ModelPoints& at, const double* theta,
                          const ModelForces& out) const {
  const int n = at.n;
  const int s = coordinates_;
  for (int d = 0; d < s; ++d) {
    for (int i = 0; i < n; ++i)
      out.g[d][i] = -excitation_[d] * at.x[i];
    for (int e = 0; e < s; ++e) {
      const double m = mass_[d * s + e];
      for (int i = 0; i < n; ++i)
        out.g[d][i] += m * at.a[e][i];
      std::fill_n(out.g_u[d * s + e], n, 0.0);
      std::fill_n(out.g_v[d * s + e], n, 0.0);
      std::fill_n(out.g_a[d * s + e], n, m);
    }
  }
  double* const* local = out.scratch;      // u, v, a
  double* const* force = out.scratch + 3;  // f, f_u, f_v, f_a, then f_theta
  for (const Term& term : terms_) {
    for (int k = 0; k < 7; ++k)
      std::fill_n(local[k], n, 0.0);
    for (int e = 0; e < s; ++e) {
      const double c = term.sees[e];
      if (c == 0.0) continue;
      for (int i = 0; i < n; ++i) {
        local[0][i] += c * at.u[e][i];
        local[1][i] += c * at.v[e][i];
        local[2][i] += c * at.a[e][i];
      }
    }
    const Points points{n, local[0], local[1], local[2]};
    const Forces forces{force[0], force[1], force[2], force[3], force + 4};
    if (!term.effect->evaluate(points, theta + term.first_parameter, term.constants.data(), forces))
      return false;
    const int p = parameter_count();
    const int own = static_cast<int>(term.effect->parameters().size());
    for (int d = 0; d < s; ++d) {
      const double w = term.acts[d];
      for (int k = 0; k < own; ++k) {
        double* column = out.g_theta[d * p + term.first_parameter + k];
        for (int i = 0; i < n; ++i)
          column[i] = w * force[4 + k][i];
      }
      if (w == 0.0) continue;
      for (int i = 0; i < n; ++i)
        out.g[d][i] += w * force[0][i];
      for (int e = 0; e < s; ++e) {
        const double c = w * term.sees[e];
        if (c == 0.0) continue;
        for (int i = 0; i < n; ++i) {
          out.g_u[d * s + e][i] += c * force[1][i];
          out.g_v[d * s + e][i] += c * force[2][i];
          out.g_a[d * s + e][i] += c * force[3][i];
        }
      }
    }
  }
  return true;
}

double Model::velocity_kink(const double* theta) const {
  if (coordinates_ != 1) return 0.0;
  double kink = 0.0;
  for (const Term& term : terms_)
    kink += term.effect->velocity_kink(theta + term.first_parameter, term.constants.data());
  return kink;
}

}  // namespace shaker::estimator
