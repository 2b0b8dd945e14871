// A dead zone in the load path: stops of stiffness k with the play delta join damper and mass.
// The model separates the stroke of the damper from that of the mass (Effect::in_series). This
// effect is the load of the stops; it sees the difference y of the two strokes:
//     k [sp_w(y - delta / 2) - sp_w(-y - delta / 2)]
#include <cmath>

#include "estimator/math/simd_math.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

constexpr double kFar = 690.0;  // widths beyond which a corner has no rounding at all

// sp_w of dual.hpp, and its derivative.
SHAKER_INLINE void smooth_ramp(double x, double w, double& ramp, double& step) {
  const double widths = std::fabs(x) / w;
  const double e = fast_exp(-(widths < kFar ? widths : kFar));
  const double over = 1.0 / (1.0 + e);
  ramp = (x > 0.0 ? x : 0.0 * x) + w * fast_log(1.0 + e);  // of no number it is none
  step = x > 0.0 ? over : e * over;
}

// With derivatives by hand, as a load path with play is stepped through in time.
SHAKER_SIMD_CLONES void add(int points, double delta, double k, double w,
                            const double* __restrict u, double* __restrict f,
                            double* __restrict f_u, double* __restrict f_delta,
                            double* __restrict f_k) {
  for (int i = 0; i < points; ++i) {
    double upper, lower, upper_step, lower_step;
    smooth_ramp(u[i] - 0.5 * delta, w, upper, upper_step);
    smooth_ramp(-u[i] - 0.5 * delta, w, lower, lower_step);
    f[i] += k * (upper - lower);
    f_u[i] += k * (upper_step + lower_step);
    f_delta[i] = -0.5 * k * (upper_step - lower_step);
    f_k[i] = upper - lower;
  }
}

class FreePlay final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"delta", "m", 5e-4, 5e-5, 1e-2, "play between the stops"},
      {"k", "1/s^2", 2e4, 5e2, 1e6, "stiffness of the stops over mass"},
  };
  static constexpr ConstantInfo kConstants[] = {
      {"w", "m", 2e-5, "depth over which a stop is met", true},
  };

  std::string_view name() const override { return "free_play"; }
  std::string_view formula() const override {
    return "k (sp(y - delta / 2) - sp(-y - delta / 2)), y = stroke of the mass - stroke of the "
           "damper";
  }
  std::string_view meaning() const override { return "play in the joints of the load path"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  bool in_series() const override { return true; }

  bool evaluate(const Points& at, const double* theta, const double* constants,
                const Forces& out) const override {
    add(at.n, theta[0], theta[1], constants[0], at.u, out.f, out.f_u, out.f_theta[0],
        out.f_theta[1]);
    return true;
  }
};

}  // namespace

const Effect& free_play() {
  static const FreePlay effect;
  return effect;
}

}  // namespace shaker::estimator
