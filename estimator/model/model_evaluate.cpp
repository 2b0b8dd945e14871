// The residual of a model and its partial derivatives: loops over the points.
#include <algorithm>

#include "estimator/math/simd_math.hpp"
#include "estimator/model/model.hpp"

namespace shaker::estimator {
namespace {

SHAKER_SIMD_CLONES void add_some(int n, double weight, const double* __restrict source,
                                 double* __restrict target) {
  for (int i = 0; i < n; ++i)
    target[i] += weight * source[i];
}
inline void add(int n, double weight, const double* source, double* target) {
  if (n == 1) *target += weight * *source;  // in a march through time; a call would be dear
  if (n > 1) add_some(n, weight, source, target);
}
inline void set_zero(int n, double* values) {
  if (n == 1) *values = 0.0;
  if (n > 1) std::fill_n(values, n, 0.0);
}

void multiply(int n, double factor, double* values) {
  for (int i = 0; factor != 1.0 && i < n; ++i)
    values[i] *= factor;
}

Points local_points(const ModelPoints& at, const double* u, const double* v, const double* a) {
  Points points;
  points.n = at.n;
  points.u = u;
  points.v = v;
  points.a = a;
  points.x = at.x;
  points.x_quadrature = at.x_quadrature;
  points.carrier_cos = at.carrier_cos;
  points.carrier_sin = at.carrier_sin;
  points.carrier_amplitude = at.carrier_amplitude;
  points.carrier_omega = at.carrier_omega;
  points.harmonics = at.harmonics;
  return points;
}

SHAKER_SIMD_CLONES void begin_equation(int n, double mass, double excitation,
                                       const double* __restrict a, const double* __restrict x,
                                       double* __restrict g, double* __restrict g_u,
                                       double* __restrict g_v, double* __restrict g_a) {
  for (int i = 0; i < n; ++i) {
    g[i] = mass * a[i] - excitation * x[i];
    g_u[i] = g_v[i] = 0.0;
    g_a[i] = mass;
  }
}

// Sets inertia and excitation of the only equation, with zero derivatives over u and v.
void begin_plain(const ModelPoints& at, double mass, double excitation, const ModelForces& out) {
  begin_equation(at.n, mass, excitation, at.a[0], at.x, out.g[0], out.g_u[0], out.g_v[0],
                 out.g_a[0]);
}

// Lets an effect add directly to that equation.
Forces plain_forces(const ModelForces& out) {
  Forces forces;
  forces.f = out.g[0];
  forces.f_u = out.g_u[0];
  forces.f_v = out.g_v[0];
  forces.f_a = out.g_a[0];
  return forces;
}

// Layout of the scratch arrays of `evaluate_general`.
constexpr int kLocal = 0;  // u, v, a
constexpr int kForce = 3;  // f, f_u, f_v, f_a, f_x
constexpr int kTrueX = 8;  // the corrected excitation
constexpr int kFurther = 9;

}  // namespace

// The contribution of one effect: its arrays in the scratch, and for each of its own parameters
// the index in the model.
struct Model::Share {
  const Term* term;
  int n, s, p, first, internals, own, all;
  Forces forces;
  double* rows[3 * kMostInternals * kMostInternals];
  int parameter[kMostParameters];
  double local[kMostParameters];
};

// For one coordinate: the effects add directly to the output.
bool Model::evaluate_plain(const ModelPoints& at, const double* theta,
                           const ModelForces& out) const {
  const int n = at.n;
  begin_plain(at, mass_[0], excitation_[0], out);
  for (const Term& term : instruments_) {
    for (std::size_t k = 0; k < term.effect->parameters().size(); ++k)
      std::fill_n(out.g_theta[term.parameter(k)], n, 0.0);
  }
  for (const int other : idle_)
    std::fill_n(out.g_theta[other], n, 0.0);
  const Points points = local_points(at, at.u[0], at.v[0], at.a[0]);
  for (const Term& term : terms_) {
    Forces forces = plain_forces(out);
    if (term.borrowed.empty() && term.own.empty()) {
      forces.f_theta = out.g_theta + term.first_parameter;
      if (!term.effect->evaluate(points, theta + term.first_parameter, term.constants.data(),
                                 forces))
        return false;
      continue;
    }
    double local[kMostParameters];
    double* columns[kMostParameters];
    term.gather(theta, local);
    const std::size_t own = term.effect->parameters().size();
    for (std::size_t k = 0; k < own; ++k)
      columns[k] = out.g_theta[term.parameter(k)];
    for (std::size_t k = 0; k < term.borrowed.size(); ++k)
      columns[own + k] = out.scratch[k];
    forces.f_theta = columns;
    if (!term.effect->evaluate(points, local, term.constants.data(), forces)) return false;
    for (std::size_t k = 0; k < own; ++k)
      multiply(n, term.factor(k), columns[k]);
    for (std::size_t k = 0; k < term.borrowed.size(); ++k) {
      if (term.borrowed[k] >= 0)
        add(n, term.factor(own + k), out.scratch[k], out.g_theta[term.borrowed[k]]);
    }
  }
  return true;
}

unsigned Model::evaluate_lanes(const ModelPoints& at, const double* theta,
                               const ModelForces& out) const {
  begin_plain(at, mass_[0], excitation_[0], out);
  unsigned sound = ~0U;
  const Points points = local_points(at, at.u[0], at.v[0], at.a[0]);
  for (const Term& term : terms_) {
    Forces forces = plain_forces(out);
    forces.f_theta = out.g_theta + term.first_parameter;
    sound &= term.effect->evaluate_lanes(points, theta + 8 * term.first_parameter,
                                         term.constants.data(), forces);
  }
  return sound;
}

// For several coordinates: each effect sees a combination of them. Its force and derivatives are
// distributed over the equations in which it acts.
bool Model::evaluate_general(const ModelPoints& at, const double* theta,
                             const ModelForces& out) const {
  clear(at, theta, out);
  add_inertia(0, at, out);
  for (const Term& term : terms_) {
    if (!add_term(term, at, theta, out)) return false;
  }
  return true;
}

bool Model::evaluate_internal(const ModelPoints& at, const double* theta,
                              const ModelForces& out) const {
  clear(at, theta, out);
  add_inertia(mechanical_, at, out);
  const auto acts_on_internal = [this](const Term& term) {
    return !term.effect->internals().empty() ||
           std::any_of(term.acts.begin() + mechanical_, term.acts.end(),
                       [](double weight) { return weight != 0.0; });
  };
  for (const Term& term : terms_) {
    if (acts_on_internal(term) && !add_term(term, at, theta, out)) return false;
  }
  return true;
}

// Adds inertia and excitation to the equations from `first` on.
void Model::add_inertia(int first, const ModelPoints& at, const ModelForces& out) const {
  const int s = coordinates();
  for (int d = first; d < s; ++d) {
    if (excitation_[d] != 0.0) add(at.n, -excitation_[d], at.x, out.g[d]);
    for (int e = 0; e < s; ++e) {
      const double m = mass_[d * s + e];
      if (m == 0.0) continue;
      add(at.n, m, at.a[e], out.g[d]);
      std::fill_n(out.g_a[d * s + e], at.n, m);
    }
  }
}

bool Model::evaluate_part(Part part, const ModelPoints& at, const double* theta,
                          const ModelForces& out) const {
  clear(at, theta, out);
  for (const Term& term : terms_) {
    const bool wanted =
        part == Part::load ? term.effect->carries_load() : term.effect->moves_base();
    if (wanted && !add_term(term, at, theta, out)) return false;
  }
  return true;
}

// Sets all outputs to zero, and computes the corrected excitation that the effects see.
void Model::clear(const ModelPoints& at, const double* theta, const ModelForces& out) const {
  const int s = coordinates();
  for (int d = 0; d < s; ++d) {
    set_zero(at.n, out.g[d]);
    for (int e = 0; e < s; ++e) {
      for (double* const* slopes : {out.g_u, out.g_v, out.g_a})
        set_zero(at.n, slopes[d * s + e]);
    }
    for (int k = 0; out.g_theta != nullptr && k < parameter_count(); ++k)
      set_zero(at.n, out.g_theta[d * parameter_count() + k]);
  }
  if (exciter_parameters_ == 0) return;
  std::copy_n(at.x, at.n, out.scratch[kTrueX]);
  for (const Term& term : terms_) {
    if (term.effect->group() != Group::exciter) continue;
    set_zero(at.n, out.scratch[kForce]);
    const Share share = share_of(term, theta, out);
    term.effect->evaluate(local_points(at, at.u[0], at.v[0], at.a[0]), share.local,
                          term.constants.data(), share.forces);
    add(at.n, -1.0, share.forces.f, out.scratch[kTrueX]);
    for (int k = 0; k < share.own; ++k)
      std::copy_n(share.forces.f_theta[k], at.n, exciter_column(term, k, out));
  }
}

Model::Share Model::share_of(const Term& term, const double* theta, const ModelForces& out) const {
  Share share;
  share.term = &term;
  share.s = coordinates();
  share.p = parameter_count();
  share.first = term.first_internal;
  share.internals = static_cast<int>(term.effect->internals().size());
  share.own = static_cast<int>(term.effect->parameters().size());
  share.all = share.own + static_cast<int>(term.borrowed.size());
  for (int k = 0; k < share.all; ++k)
    share.parameter[k] = k < share.own ? term.parameter(k) : term.borrowed[k - share.own];
  term.gather(theta, share.local);

  double* const* force = out.scratch + kForce;
  double* const* further = out.scratch + kFurther;
  const int w = share.internals;
  Forces& f = share.forces;
  f.f = force[0];
  f.f_u = force[1];
  f.f_v = force[2];
  f.f_a = force[3];
  f.f_x = force[4];
  f.f_w = further;
  f.f_w_dot = further + w;
  f.f_w_ddot = further + 2 * w;
  f.h_u = further + 3 * w;
  f.h_v = further + 4 * w;
  f.h_a = further + 5 * w;
  f.h_x = further + 6 * w;
  f.f_theta = further + 7 * most_internals_;
  f.h_theta = f.f_theta + most_parameters_;
  f.h = out.g + share.first;
  for (int d = 0; d < w; ++d) {
    for (int e = 0; e < w; ++e) {
      const int place = (share.first + d) * share.s + share.first + e;
      share.rows[d * w + e] = out.g_u[place];
      share.rows[(w + d) * w + e] = out.g_v[place];
      share.rows[(2 * w + d) * w + e] = out.g_a[place];
    }
  }
  return share;
}

bool Model::add_term(const Term& term, const ModelPoints& at, const double* theta,
                     const ModelForces& out) const {
  const int n = at.n;
  const bool exciter = term.effect->group() == Group::exciter;
  for (int k = 0; k < kTrueX; ++k)
    set_zero(n, out.scratch[k]);
  for (int e = 0; e < coordinates(); ++e) {
    const double c = term.sees[e];
    if (c == 0.0) continue;
    add(n, c, at.u[e], out.scratch[kLocal]);
    add(n, c, at.v[e], out.scratch[kLocal + 1]);
    add(n, c, at.a[e], out.scratch[kLocal + 2]);
  }
  Points points =
      local_points(at, out.scratch[kLocal], out.scratch[kLocal + 1], out.scratch[kLocal + 2]);
  points.w = at.u + term.first_internal;
  points.w_dot = at.v + term.first_internal;
  points.w_ddot = at.a + term.first_internal;
  if (!exciter && exciter_parameters_ > 0) points.x = out.scratch[kTrueX];

  Share share = share_of(term, theta, out);
  share.n = n;
  const int w = share.internals;
  share.forces.h_w = share.rows;
  share.forces.h_w_dot = share.rows + w * w;
  share.forces.h_w_ddot = share.rows + 2 * w * w;
  if (!term.effect->evaluate(points, share.local, term.constants.data(), share.forces))
    return false;
  spread_force(share, out);
  spread_rows(share, out);
  if (term.effect->sees_excitation() && !exciter && out.g_theta != nullptr)
    spread_excitation(share, out);
  return true;
}

double* Model::exciter_column(const Term& term, int parameter, const ModelForces& out) const {
  const int first = kFurther + 7 * most_internals_ + (1 + most_internals_) * most_parameters_;
  return out.scratch[first + term.first_exciter_column + parameter];
}

void Model::spread_force(const Share& share, const ModelForces& out) const {
  const Term& term = *share.term;
  const Forces& f = share.forces;
  const int s = share.s;
  for (int d = 0; d < s; ++d) {
    const double w = term.acts[d];
    if (w == 0.0) continue;
    add(share.n, w, f.f, out.g[d]);
    for (int k = 0; out.g_theta != nullptr && k < share.all; ++k) {
      if (share.parameter[k] >= 0)
        add(share.n, w * term.factor(k), f.f_theta[k],
            out.g_theta[d * share.p + share.parameter[k]]);
    }
    for (int e = 0; e < s; ++e) {
      const double c = w * term.sees[e];
      if (c == 0.0) continue;
      add(share.n, c, f.f_u, out.g_u[d * s + e]);
      add(share.n, c, f.f_v, out.g_v[d * s + e]);
      add(share.n, c, f.f_a, out.g_a[d * s + e]);
    }
    for (int k = 0; k < share.internals; ++k) {
      add(share.n, w, f.f_w[k], out.g_u[d * s + share.first + k]);
      add(share.n, w, f.f_w_dot[k], out.g_v[d * s + share.first + k]);
      add(share.n, w, f.f_w_ddot[k], out.g_a[d * s + share.first + k]);
    }
  }
}

// Adds the effect's own equations. Their derivatives over its internal coordinates are in place.
void Model::spread_rows(const Share& share, const ModelForces& out) const {
  for (int r = 0; r < share.internals; ++r) {
    const int d = share.first + r;
    for (int e = 0; e < share.s; ++e) {
      const double c = share.term->sees[e];
      if (c == 0.0) continue;
      add(share.n, c, share.forces.h_u[r], out.g_u[d * share.s + e]);
      add(share.n, c, share.forces.h_v[r], out.g_v[d * share.s + e]);
      add(share.n, c, share.forces.h_a[r], out.g_a[d * share.s + e]);
    }
    for (int k = 0; out.g_theta != nullptr && k < share.all; ++k) {
      if (share.parameter[k] >= 0)
        add(share.n, share.term->factor(k), share.forces.h_theta[r * share.all + k],
            out.g_theta[d * share.p + share.parameter[k]]);
    }
  }
}

// Adds the dependence on the exciter's parameters of an effect that sees the excitation.
void Model::spread_excitation(const Share& share, const ModelForces& out) const {
  const auto add_product = [&](double w, const double* slope, const double* column,
                               double* target) {
    for (int i = 0; i < share.n; ++i)
      target[i] -= w * slope[i] * column[i];
  };
  for (const Term& term : terms_) {
    if (term.effect->group() != Group::exciter) continue;
    for (int k = 0; k < static_cast<int>(term.effect->parameters().size()); ++k) {
      const double* column = exciter_column(term, k, out);
      const int parameter = term.parameter(k);
      const double factor = term.factor(k);
      for (int d = 0; d < share.s; ++d) {
        const double w = share.term->acts[d];
        if (w != 0.0)
          add_product(w * factor, share.forces.f_x, column, out.g_theta[d * share.p + parameter]);
      }
      for (int r = 0; r < share.internals; ++r)
        add_product(factor, share.forces.h_x[r], column,
                    out.g_theta[(share.first + r) * share.p + parameter]);
    }
  }
}

void Model::true_excitation(const ModelPoints& at, const double* theta, double* x,
                            double* const* x_theta, double* const* scratch) const {
  std::copy_n(at.x, at.n, x);
  for (int k = 0; k < parameter_count(); ++k)
    std::fill_n(x_theta[k], at.n, 0.0);
  for (const Term& term : terms_) {
    if (term.effect->group() != Group::exciter) continue;
    std::fill_n(scratch[0], at.n, 0.0);
    Forces forces;
    forces.f = scratch[0];
    forces.f_theta = scratch + 1;
    const Points points = local_points(at, at.u[0], at.v[0], at.a[0]);
    double local[kMostParameters];
    term.gather(theta, local);
    term.effect->evaluate(points, local, term.constants.data(), forces);
    add(at.n, -1.0, scratch[0], x);
    for (std::size_t k = 0; k < term.effect->parameters().size(); ++k)
      add(at.n, -term.factor(k), scratch[1 + k], x_theta[term.parameter(k)]);
  }
}

}  // namespace shaker::estimator
