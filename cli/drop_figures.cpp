#include "cli/drop_figures.hpp"

#include <string_view>

namespace shaker::cli {

std::string figure_unit(std::size_t figure, const std::string& length, bool newton) {
  const auto& f = estimator::kDropFigures[figure];
  if (newton && f.length == 1 && f.time == -2 && std::string_view(f.name) != "peak_deceleration")
    return "N";
  if (newton && f.length == 2) return "J";
  if (f.length == 0) return f.time == 0 ? "-" : "s";
  if (f.time == 0) return length;
  if (f.time == -1) return length + "/s";
  return f.length == 2 ? length + "^2/s^2" : length + "/s^2";
}

std::string figure_label(std::size_t figure, bool newton) {
  constexpr std::string_view kPerMass = " per mass";
  std::string label = estimator::kDropFigures[figure].label;
  if (const auto at = label.find(kPerMass); newton && at != std::string::npos)
    label.erase(at, kPerMass.size());
  return label;
}

bool is_gear_figure(std::size_t figure) {
  return may_be_absent(figure) && figure != figure_called(kMarginFigure);
}

bool may_be_absent(std::size_t figure) {
  return figure > figure_called("travel");
}

}  // namespace shaker::cli
