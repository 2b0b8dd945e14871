// A relief valve that opens in compression: above f_rel the orifice force rises only k times as
// fast.
#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct ReliefValve final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"relief_force", "m/s^2", 0.0, 0.0, 1e3, "f_rel, at which the valve opens; 0: never"},
      {"relief_share", "1", 0.3, 0.0, 1.0, "k, what is left of the rise past f_rel"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("relief_force") == 0.0) return nullptr;
    return std::make_unique<ReliefValve>(values);
  }

  double theta1, opening, share;

  explicit ReliefValve(const Values& values)
      : theta1(values.at("theta1")),
        opening(values.at("relief_force")),
        share(values.at("relief_share")) {}

  void add(const Motion& m, Balance& sum) const override {
    if (m.direction <= 0.0) return;
    const double beyond = theta1 * m.v * m.v - opening;
    if (beyond > 0.0) sum.force -= (1.0 - share) * beyond;
  }
};

}  // namespace

const PartEntry kReliefValve = {"relief_valve", ReliefValve::kParameters, ReliefValve::make};

}  // namespace shaker::sim
