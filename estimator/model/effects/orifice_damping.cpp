// theta1 |v| v: turbulent flow through the orifice, theta1 = rho A^3 / (2 M (C_d A_o)^2).
// (6.3), derivatives (A.3) and the first entry of (A.5).
#include <cmath>

#include "estimator/math/lanes.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

SHAKER_SIMD_CLONES void add(int n, const double* __restrict v, double theta1, double* __restrict f,
                            double* __restrict f_v, double* __restrict f_theta1) {
  for (int i = 0; i < n; ++i) {
    const double magnitude = std::fabs(v[i]);
    const double square = magnitude * v[i];
    f[i] += theta1 * square;
    f_v[i] += 2.0 * theta1 * magnitude;
    f_theta1[i] = square;
  }
}

SHAKER_SIMD_CLONES void add_lanes(int points, const Lanes* v, const Lanes& theta1, Lanes* f,
                                  Lanes* f_v, Lanes* f_theta1) {
  for (int i = 0; i < points; ++i) {
    const Lanes speed = magnitude(v[i]);
    const Lanes square = speed * v[i];
    f[i] += theta1 * square;
    f_v[i] += 2.0 * theta1 * speed;
    f_theta1[i] = square;
  }
}

class OrificeDamping final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"theta1", "1/m", 15.0, 0.0, 1e4, "orifice damping: rho A^3 / (2 M (C_d A_o)^2)", 0.0},
  };

  std::string_view name() const override { return "orifice_damping"; }
  std::string_view formula() const override { return "theta1 |v| v"; }
  std::string_view meaning() const override {
    return "damping with the square of the velocity: oil through an orifice, or drag";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  bool evaluate(const Points& at, const double* theta, const double*,
                const Forces& out) const override {
    add(at.n, at.v, theta[0], out.f, out.f_v, out.f_theta[0]);
    return true;
  }
  unsigned evaluate_lanes(const Points& at, const double* theta, const double*,
                          const Forces& out) const override {
    add_lanes(at.n / kLanes, as_lanes(at.v), *as_lanes(theta), as_lanes(out.f), as_lanes(out.f_v),
              as_lanes(out.f_theta[0]));
    return (1U << kLanes) - 1;
  }
  bool has_velocity_kink() const override { return true; }
  double velocity_kink(const double* theta, const double*, double) const override {
    return 4.0 * theta[0];
  }
};

}  // namespace

const Effect& orifice_damping() {
  static const OrificeDamping effect;
  return effect;
}

}  // namespace shaker::estimator
