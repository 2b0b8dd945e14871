// u_measured = u + f / k_n: elastic deflection between the measured points under the load f of
// the damper.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/instrument/instrument.hpp"

namespace shaker::estimator {
namespace {

class SeriesCompliance final : public InstrumentEffect {
 public:
  static constexpr ParameterInfo kParameters[] = {
      {"k_n", "1/s^2", 2e4, 1e3, 1e7, "stiffness of the joint over mass"},
  };

  std::string_view name() const override { return "series_compliance"; }
  std::string_view formula() const override { return "y = u + f / k_n, f = load of the damper"; }
  std::string_view meaning() const override {
    return "joints within the measured length that yield under load";
  }
  std::span<const ParameterInfo> parameters() const override { return kParameters; }
  Group group() const override { return Group::damper; }
  bool sees_load() const override { return true; }
  void observe(const Signal& at, const double* theta, const double*,
               const Seen& out) const override {
    const double compliance = 1.0 / theta[0];
    for (int i = 0; i < at.n; ++i) {
      out.y[i] = at.y[i] + compliance * at.load[i];
      out.y_y[i] = 1.0;
      out.y_load[i] = compliance;
      out.y_theta[0][i] = -compliance * compliance * at.load[i];
    }
  }
};

}  // namespace

const Effect& series_compliance() {
  static const SeriesCompliance effect;
  return effect;
}

}  // namespace shaker::estimator
