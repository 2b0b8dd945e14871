// x_true = x + X sum over h = 2..5 of a_h cos(h phase) + b_h sin(h phase): harmonics of the
// excitation that the record lacks. X and phase are those of its fundamental.
#include <algorithm>

#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

class ExciterDistortion final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"a2", "-", 0.0, -0.2, 0.2, "cosine of harmonic 2 over the fundamental", 0.0},
      {"b2", "-", 0.0, -0.2, 0.2, "sine of harmonic 2 over the fundamental", 0.0},
      {"a3", "-", 0.0, -0.2, 0.2, "cosine of harmonic 3 over the fundamental", 0.0},
      {"b3", "-", 0.0, -0.2, 0.2, "sine of harmonic 3 over the fundamental", 0.0},
      {"a4", "-", 0.0, -0.2, 0.2, "cosine of harmonic 4 over the fundamental", 0.0},
      {"b4", "-", 0.0, -0.2, 0.2, "sine of harmonic 4 over the fundamental", 0.0},
      {"a5", "-", 0.0, -0.2, 0.2, "cosine of harmonic 5 over the fundamental", 0.0},
      {"b5", "-", 0.0, -0.2, 0.2, "sine of harmonic 5 over the fundamental", 0.0},
  };

  std::string_view name() const override { return "exciter_distortion"; }
  std::string_view formula() const override {
    return "x_true = x + X sum of a_h cos(h phase) + b_h sin(h phase), h = 2..5";
  }
  std::string_view meaning() const override {
    return "harmonics of the excitation that were not recorded";
  }
  Group group() const override { return Group::exciter; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  bool sees_excitation() const override { return true; }
  bool needs_carrier() const override { return true; }

  // Differentiated by hand: dual numbers with eight parameters take a tenth of a diagnosis.
  bool evaluate(const Points& at, const double* theta, const double*,
                const Forces& out) const override {
    const bool excited = at.carrier_cos != nullptr;
    for (int k = 0; !excited && k < 8; ++k)
      std::fill_n(out.f_theta[k], at.n, 0.0);
    for (int i = 0; excited && i < at.n; ++i) {
      const double c = at.carrier_cos[i], s = at.carrier_sin[i];
      double cosine = c, sine = s;
      for (int h = 0; h < 4; ++h) {
        const double next = cosine * c - sine * s;
        sine = sine * c + cosine * s;
        cosine = next;
        out.f_theta[2 * h][i] = -at.carrier_amplitude * cosine;
        out.f_theta[2 * h + 1][i] = -at.carrier_amplitude * sine;
        out.f[i] -= at.carrier_amplitude * (theta[2 * h] * cosine + theta[2 * h + 1] * sine);
      }
    }
    return true;
  }
};

}  // namespace

const Effect& exciter_distortion() {
  static const ExciterDistortion effect;
  return effect;
}

}  // namespace shaker::estimator
