#include "config/pin_table.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace shaker::config {
namespace {

// The first knot that does not go on in the direction of `sign`; 0: all do.
std::size_t first_turn(const std::vector<double>& values, double sign, bool flat_allowed) {
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double rise = sign * (values[i] - values[i - 1]);
    if (!(rise > 0.0 || (flat_allowed && rise == 0.0))) return i;
  }
  return 0;
}

std::string fault_of_areas(const PinTable& table) {
  const std::vector<double>& area = table.area;
  if (area.size() != table.stroke.size())
    return fmt::format("has {} areas for {} strokes; give one area for each stroke, or none",
                       area.size(), table.stroke.size());
  for (std::size_t i = 0; i < area.size(); ++i) {
    if (!(area[i] > 0.0))
      return fmt::format("has the area {} at knot {} (stroke {}); it must be above 0", area[i],
                         i + 1, table.stroke[i]);
  }
  const double sign = area.back() > area.front() ? 1.0 : -1.0;
  const std::size_t turn = first_turn(area, sign, true);
  if (turn == 0) return {};
  return fmt::format(
      "has areas that do not {} all along: {} at knot {} and {} at knot {} (strokes {} and {}). A "
      "pin narrows the orifice along the stroke or widens it; correct the knot",
      sign > 0.0 ? "increase" : "decrease", area[turn - 1], turn, area[turn], turn + 1,
      table.stroke[turn - 1], table.stroke[turn]);
}

}  // namespace

std::string fault_of(const PinTable& table) {
  const std::size_t knots = table.stroke.size();
  if (knots < kFewestKnots || knots > kMostKnots)
    return fmt::format("has {} knots; {} to {} are allowed", knots, kFewestKnots, kMostKnots);
  if (const std::size_t turn = first_turn(table.stroke, 1.0, false); turn > 0)
    return fmt::format(
        "is not increasing: the stroke is {} at knot {} and {} at knot {}. Order the knots by "
        "stroke, and give each stroke once",
        table.stroke[turn - 1], turn, table.stroke[turn], turn + 1);
  return table.area.empty() ? std::string() : fault_of_areas(table);
}

nlohmann::ordered_json as_json(const PinTable& table) {
  nlohmann::ordered_json json = {{"stroke", table.stroke}};
  if (!table.area.empty()) json["area"] = table.area;
  json["smoothness"] = table.smoothness;
  return json;
}

}  // namespace shaker::config
