#include "cli/pin_areas.hpp"

#include <cmath>

#include <fmt/format.h>

#include "report/text_table.hpp"

namespace shaker::cli {

using estimator::AreaAtKnot;

nlohmann::ordered_json pin_areas_json(const std::vector<AreaAtKnot>& areas) {
  auto list = nlohmann::ordered_json::array();
  for (const AreaAtKnot& at : areas) {
    nlohmann::ordered_json row = {{"stroke", at.stroke}, {"area", at.area}};
    if (std::isfinite(at.lower) && std::isfinite(at.upper)) row["interval"] = {at.lower, at.upper};
    list.push_back(std::move(row));
  }
  return list;
}

std::string pin_areas_text(const std::vector<AreaAtKnot>& areas, const std::string& length) {
  if (areas.empty()) return {};
  std::vector<std::vector<std::string>> rows = {
      {fmt::format("stroke, {}", length), "area of the orifice", "95 %"}};
  for (const AreaAtKnot& at : areas)
    rows.push_back({fmt::format("{:.5g}", at.stroke), fmt::format("{:.4g}", at.area),
                    std::isfinite(at.lower) && std::isfinite(at.upper)
                        ? fmt::format("{:.4g} to {:.4g}", at.lower, at.upper)
                        : std::string("not determined")});
  return "\nThe metering pin:\n\n" + report::text_table(rows, {true, true, true}) + "\n";
}

}  // namespace shaker::cli
