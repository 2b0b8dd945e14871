// u_measured = u + f / k_n: elastic deflection between the measured points under the load f of
// the damper.
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/instrument/instrument.hpp"

namespace shaker::estimator {
namespace {

constexpr ParameterInfo kJoint[] = {
    {"k_n", "1/s^2", 2e4, 1e2, 1e7, "stiffness of the joint over mass"},
};
constexpr std::string_view kName = "series_compliance";
constexpr std::string_view kFormula = "y = u + f / k_n, f = load of the damper";
constexpr std::string_view kMeaning = "joints within the measured length that yield under load";

// In the load path: the damper has a stroke u of its own, and this is the load k_n (y - u) of the
// joint.
class JointInSeries final : public Effect {
 public:
  std::string_view name() const override { return kName; }
  std::string_view formula() const override { return kFormula; }
  std::string_view meaning() const override { return kMeaning; }
  std::span<const ParameterInfo> parameters() const override { return kJoint; }
  bool in_series() const override { return true; }
  bool evaluate(const Points& at, const double* theta, const double*,
                const Forces& out) const override {
    for (int i = 0; i < at.n; ++i) {
      out.f[i] += theta[0] * at.u[i];
      out.f_u[i] += theta[0];
      out.f_theta[0][i] = at.u[i];
    }
    return true;
  }
};

class SeriesCompliance final : public InstrumentEffect {
 public:
  std::string_view name() const override { return kName; }
  std::string_view formula() const override { return kFormula; }
  std::string_view meaning() const override { return kMeaning; }
  std::span<const ParameterInfo> parameters() const override { return kJoint; }
  Group group() const override { return Group::damper; }
  bool sees_load() const override { return true; }
  const Effect& as_part_in_series() const override {
    static const JointInSeries joint;
    return joint;
  }
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
