// P = theta2 (1 - theta3 u)^(-theta4): the polytropic gas column, theta2 = p0 A / M,
// theta3 = A / V0. (6.3), derivative (A.2), and (A.5) with a correction: the exponents of its
// second and third entries are -theta4 and -theta4 - 1.
#include "estimator/math/lanes.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

constexpr double kClosestToWall = 1e-9;  // smallest admissible 1 - theta3 u

SHAKER_SIMD_CLONES long add(int n, const double* __restrict u, double theta2, double theta3,
                            double theta4, double* __restrict f, double* __restrict f_u,
                            double* __restrict f_theta2, double* __restrict f_theta3,
                            double* __restrict f_theta4) {
  const double over_theta2 = 1.0 / theta2;
  long inadmissible = 0;
  for (int i = 0; i < n; ++i) {
    const double raw = 1.0 - theta3 * u[i];
    const bool admissible = raw > kClosestToWall;  // also false for NaN
    inadmissible += admissible ? 0 : 1;
    const double w = admissible ? raw : 1.0;
    const double logarithm = fast_log(w);
    const double force = theta2 * fast_exp(-theta4 * logarithm);
    const double slope = force * theta4 / w;
    f[i] += force;
    f_u[i] += slope * theta3;
    f_theta2[i] = force * over_theta2;
    f_theta3[i] = slope * u[i];
    f_theta4[i] = -force * logarithm;
  }
  return inadmissible;
}

// The same for a batch: one Lanes for each point, and in `theta` one for each parameter.
SHAKER_SIMD_CLONES unsigned add_lanes(int points, const Lanes* u, const Lanes* theta, Lanes* f,
                                      Lanes* f_u, Lanes* f_theta2, Lanes* f_theta3,
                                      Lanes* f_theta4) {
  const Lanes over_theta2 = 1.0 / theta[0];
  LaneMask admissible = ~LaneMask{};
  for (int i = 0; i < points; ++i) {
    const Lanes raw = 1.0 - theta[1] * u[i];
    const LaneMask here = raw > kClosestToWall;
    admissible &= here;
    const Lanes w = chosen(here, raw, 1.0);
    Lanes logarithm;
    fast_log(w, logarithm);
    Lanes power;
    fast_exp(-theta[2] * logarithm, power);
    const Lanes force = theta[0] * power;
    const Lanes slope = force * theta[2] / w;
    f[i] += force;
    f_u[i] += slope * theta[1];
    f_theta2[i] = force * over_theta2;
    f_theta3[i] = slope * u[i];
    f_theta4[i] = -force * logarithm;
  }
  return bits_of(admissible);
}

class GasSpring final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"theta2", "m/s^2", 1.5, 1e-9, 1e4, "gas preload p0 A / M"},
      {"theta3", "1/m", 5.0, 1e-9, 1e4,
       "A / V0: the stroke 1/theta3 would crush the gas to nothing"},
      {"theta4", "-", 1.1, 0.1, 5.0, "polytropic index: 1 isothermal, 1.4 adiabatic air"},
  };

  std::string_view name() const override { return "gas_spring"; }
  std::string_view formula() const override { return "theta2 (1 - theta3 u)^(-theta4)"; }
  std::string_view meaning() const override { return "the gas column, a polytrope"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  bool evaluate(const Points& at, const double* theta, const double*,
                const Forces& out) const override {
    return add(at.n, at.u, theta[0], theta[1], theta[2], out.f, out.f_u, out.f_theta[0],
               out.f_theta[1], out.f_theta[2]) == 0;
  }
  unsigned evaluate_lanes(const Points& at, const double* theta, const double*,
                          const Forces& out) const override {
    return add_lanes(at.n / kLanes, as_lanes(at.u), as_lanes(theta), as_lanes(out.f),
                     as_lanes(out.f_u), as_lanes(out.f_theta[0]), as_lanes(out.f_theta[1]),
                     as_lanes(out.f_theta[2]));
  }
};

}  // namespace

const Effect& gas_spring() {
  static const GasSpring effect;
  return effect;
}

}  // namespace shaker::estimator
