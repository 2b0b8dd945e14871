// x_true = x cos(phi) + x_q sin(phi): the table moves later than recorded, by the phase phi.
// x_q is x with every harmonic a quarter of its period late.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class ExciterPhase final : public DualEffect<ExciterPhase, kSeesX, 1> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"phi", "rad", 0.0, -0.5, 0.5, "lag of the true behind the recorded excitation", 0.0},
  };

  std::string_view name() const override { return "exciter_phase"; }
  std::string_view formula() const override { return "x_true = x late by phi"; }
  std::string_view meaning() const override {
    return "the excitation comes later or earlier than recorded";
  }
  Group group() const override { return Group::exciter; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  bool needs_carrier() const override { return true; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double*, T& f, T*) {
    f = at.x * (1.0 - cos(theta[0])) - at.x_quadrature * sin(theta[0]);
    return true;
  }
};

}  // namespace

const Effect& exciter_phase() {
  static const ExciterPhase effect;
  return effect;
}

}  // namespace shaker::estimator
