// Draws values over a plane as coloured cells, with a colour scale beside them.
#include <algorithm>
#include <cmath>

#include "report/plot/frame.hpp"

namespace shaker::report {
namespace {

constexpr double kScaleWidth = 70.0;

// White at 0, dark blue at -1 and dark red at +1.
std::string colour(double share) {
  const double s = std::clamp(share, -1.0, 1.0);
  const double cold[] = {33, 102, 172}, warm[] = {178, 24, 43};
  const double* end = s < 0.0 ? cold : warm;
  const double mix = std::abs(s);
  int rgb[3];
  for (int i = 0; i < 3; ++i)
    rgb[i] = static_cast<int>(std::lround(247.0 + mix * (end[i] - 247.0)));
  return fmt::format("#{:02x}{:02x}{:02x}", rgb[0], rgb[1], rgb[2]);
}

std::string scale(double largest, const std::string& unit, double x, double top, double bottom) {
  constexpr int kSteps = 21;
  const double height = (bottom - top) / kSteps;
  std::string svg;
  for (int k = 0; k < kSteps; ++k) {
    const double share = 1.0 - 2.0 * k / (kSteps - 1.0);
    svg +=
        fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"12\" height=\"{:.1f}\" fill=\"{}\"/>",
                    x, top + k * height, height + 0.3, colour(share));
  }
  for (const double share : {1.0, 0.0, -1.0}) {
    svg += fmt::format("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\">{:.2g}</text>", x + 16.0,
                       top + (0.5 - 0.5 * share) * (bottom - top) + 4.0, share * largest);
  }
  return svg + fmt::format("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", x,
                           bottom + 17.0, escaped(unit));
}

}  // namespace

std::string to_svg(const Map& map) {
  const std::size_t columns = map.x_edges.size() - 1, rows = map.y_edges.size() - 1;
  double largest = 0.0;
  for (const double value : map.values) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  if (largest == 0.0) largest = 1.0;

  Axis x = map.x, y = map.y;  // to the edges, without a margin
  x.from = x.from.value_or(map.x_edges.front());
  x.to = x.to.value_or(map.x_edges.back());
  y.from = y.from.value_or(map.y_edges.front());
  y.to = y.to.value_or(map.y_edges.back());
  Frame frame(map.title, map.width, map.height, {}, 14.0 + kScaleWidth);
  frame.axes(x, range_of(x, map.x_edges), y, range_of(y, map.y_edges));
  for (std::size_t j = 0; j < rows; ++j) {
    for (std::size_t i = 0; i < columns; ++i) {
      const double value = map.values[j * columns + i];
      if (!std::isfinite(value)) continue;
      const double left = frame.x(map.x_edges[i]), right = frame.x(map.x_edges[i + 1]);
      const double top = frame.y(map.y_edges[j + 1]), bottom = frame.y(map.y_edges[j]);
      frame.add(
          fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
                      "fill=\"{}\"><title>{:.3g} {}</title></rect>\n",
                      left, top, right - left + 0.3, bottom - top + 0.3, colour(value / largest),
                      value, escaped(map.unit)));
      if (map.dotted.empty() || map.dotted[j * columns + i] == 0) continue;
      frame.add(fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"1.1\" fill=\"#777\"/>\n",
                            0.5 * (left + right), 0.5 * (top + bottom)));
    }
  }
  frame.add(scale(largest, map.unit, frame.right() + 14.0, frame.top(), frame.bottom()));
  return frame.close();
}

}  // namespace shaker::report
