// -g: the weight of the sprung mass. Its constant is the model file's "gravity".
#include "estimator/math/simd_math.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

SHAKER_SIMD_CLONES void add(int n, double g, double* f) {
  for (int i = 0; i < n; ++i)
    f[i] -= g;
}

class Gravity final : public Effect {
 public:
  static constexpr ConstantInfo kConstants[] = {{"g", "m/s^2", 9.80665, "acceleration of gravity"}};

  std::string_view name() const override { return "gravity"; }
  std::string_view formula() const override { return "-g"; }
  std::string_view meaning() const override { return "weight of the sprung mass"; }
  bool carries_load() const override { return false; }
  std::span<const ConstantInfo> constants() const override { return kConstants; }
  bool evaluate(const Points& at, const double*, const double* constants,
                const Forces& out) const override {
    add(at.n, constants[0], out.f);
    return true;
  }
};

}  // namespace

const Effect& gravity() {
  static const Gravity effect;
  return effect;
}

}  // namespace shaker::estimator
