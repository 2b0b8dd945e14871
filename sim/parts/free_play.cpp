// Free play in the load path: the spring of the linear oscillator has no force within +- gap.
#include <algorithm>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct FreePlay final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"free_play", "m", 0.0, 0.0, 0.1, "half of the gap in which the spring does not pull"}};
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("free_play") == 0.0) return nullptr;
    return std::make_unique<FreePlay>(values);
  }

  double stiffness, gap;

  explicit FreePlay(const Values& values)
      : stiffness(values.at("theta2")), gap(values.at("free_play")) {}
  void add(const Motion& m, Balance& sum) const override {
    sum.force -= stiffness * std::clamp(m.u, -gap, gap);
  }
};

}  // namespace

const PartEntry kFreePlay = {"free_play", FreePlay::kParameters, FreePlay::make};

}  // namespace shaker::sim
