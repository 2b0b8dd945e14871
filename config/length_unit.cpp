#include "config/length_unit.hpp"

#include <map>

namespace shaker::config {

std::optional<double> metres(const std::string& unit) {
  static const std::map<std::string, double> known = {{"m", 1.0},   {"cm", 0.01},   {"mm", 1e-3},
                                                      {"um", 1e-6}, {"in", 0.0254}, {"ft", 0.3048}};
  const auto found = known.find(unit);
  return found == known.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace shaker::config
