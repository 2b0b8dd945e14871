// x_true = G x: the table moves G times as much as recorded.
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

class ExciterGain final : public Effect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"G", "-", 1.0, 0.9, 1.1, "true over recorded excitation", 1.0},
  };

  std::string_view name() const override { return "exciter_gain"; }
  std::string_view formula() const override { return "x_true = G x"; }
  std::string_view meaning() const override {
    return "the excitation is larger or smaller than recorded";
  }
  Group group() const override { return Group::exciter; }
  bool sees_excitation() const override { return true; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  bool evaluate(const Points& at, const double* theta, const double*,
                const Forces& out) const override {
    for (int i = 0; i < at.n; ++i) {
      out.f[i] -= (theta[0] - 1.0) * at.x[i];
      out.f_theta[0][i] = -at.x[i];
    }
    return true;
  }
};

}  // namespace

const Effect& exciter_gain() {
  static const ExciterGain effect;
  return effect;
}

}  // namespace shaker::estimator
