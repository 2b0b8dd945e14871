// An elastic buffer at the end of the stroke: [k (u - u_s) + d v] for u > u_s; it never pulls.
#include <algorithm>

#include "sim/parts/parts.hpp"

namespace shaker::sim {
namespace {

struct EndStop final : PlantPart {
  static constexpr Parameter kParameters[] = {
      {"end_stop_stiffness", "1/s^2", 0.0, 0.0, 1e7, "k of the buffer"},
      {"end_stop_position", "m", 0.17, -1.0, 1.0, "stroke at which the buffer is met"},
      {"end_stop_damping", "1/s", 0.0, 0.0, 1e4, "d of the buffer"},
  };
  static std::unique_ptr<PlantPart> make(const Values& values, Memory&) {
    if (values.at("end_stop_stiffness") == 0.0) return nullptr;
    return std::make_unique<EndStop>(values);
  }

  double k, position, d;

  explicit EndStop(const Values& values)
      : k(values.at("end_stop_stiffness")),
        position(values.at("end_stop_position")),
        d(values.at("end_stop_damping")) {}

  void add(const Motion& m, Balance& sum) const override {
    const double depth = m.u - position;
    if (depth > 0.0) sum.force += std::max(k * depth + d * m.v, 0.0);
  }
};

}  // namespace

const PartEntry kEndStop = {"end_stop", EndStop::kParameters, EndStop::make};

}  // namespace shaker::sim
