// x_true(t) = x(t + d): the record of the excitation is late by the time d, so that harmonic h
// is late by the phase h omega d. Harmonics above kCarriedHarmonics stay as recorded.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class ExciterDelay final : public DualEffect<ExciterDelay, 0u, 1> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"d", "s", 2e-3, 0.0, 0.03, "delay of the recorded behind the true excitation", 0.0},
  };

  std::string_view name() const override { return "exciter_delay"; }
  std::string_view formula() const override { return "x_true(t) = x(t + d)"; }
  std::string_view meaning() const override { return "the excitation is recorded late"; }
  Group group() const override { return Group::exciter; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  bool sees_excitation() const override { return true; }
  bool needs_carrier() const override { return true; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double*, T& f, T*) {
    const T angle = at.carrier_omega * theta[0];
    const T ahead_cos = cos(angle), ahead_sin = sin(angle);
    T turn_cos = ahead_cos, turn_sin = ahead_sin;   // h omega d
    double c = at.carrier_cos, s = at.carrier_sin;  // h phase
    f = T(0.0);
    for (int h = 0; h < kCarriedHarmonics; ++h) {
      const double now = at.harmonics[2 * h] * c + at.harmonics[2 * h + 1] * s;
      const double quarter_late = at.harmonics[2 * h] * s - at.harmonics[2 * h + 1] * c;
      f += now * (1.0 - turn_cos) + quarter_late * turn_sin;
      const T next = turn_cos * ahead_cos - turn_sin * ahead_sin;
      turn_sin = turn_sin * ahead_cos + turn_cos * ahead_sin;
      turn_cos = next;
      const double next_c = c * at.carrier_cos - s * at.carrier_sin;
      s = s * at.carrier_cos + c * at.carrier_sin;
      c = next_c;
    }
    return true;
  }
};

}  // namespace

const Effect& exciter_delay() {
  static const ExciterDelay effect;
  return effect;
}

}  // namespace shaker::estimator
