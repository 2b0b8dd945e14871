// m_a u'': inertia of fluid or parts that move with the stroke.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/dual_effect.hpp"

namespace shaker::estimator {
namespace {

class AddedMass final : public DualEffect<AddedMass, kSeesA, 1> {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"m_a", "-", 0.02, 0.0, 0.2, "added over sprung mass", 0.0},
  };

  std::string_view name() const override { return "added_mass"; }
  std::string_view formula() const override { return "m_a u''"; }
  std::string_view meaning() const override { return "mass that moves along and was not weighed"; }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  bool carries_load() const override { return false; }

  template <class T>
  static bool formula(const Local<T, 0>& at, const T* theta, const double*, T& f, T*) {
    f = theta[0] * at.a;
    return true;
  }
};

}  // namespace

const Effect& added_mass() {
  static const AddedMass effect;
  return effect;
}

}  // namespace shaker::estimator
