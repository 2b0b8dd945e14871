// Draws groups of bars.
#include <algorithm>
#include <cmath>
#include <utility>

#include "report/plot/frame.hpp"

namespace shaker::report {
namespace {

constexpr double kGap = 0.25;         // of a group's width
constexpr double kFoot = 1.2;         // start of a logarithmic axis: the smallest value over this
constexpr double kMargin = 14.0;      // to the right of the axes
constexpr double kLabelLetter = 6.2;  // width of a letter

}  // namespace

std::string to_svg(const Bars& bars) {
  std::vector<LegendRow> legend;
  std::vector<double> values;
  for (std::size_t s = 0; s < bars.series.size(); ++s) {
    legend.push_back(
        {bars.series[s], fmt::format("<rect class=\"fill {}\" y=\"1\" width=\"22\" height=\"10\"/>",
                                     name(bars.inks[s % bars.inks.size()]))});
    values.insert(values.end(), bars.values[s].begin(), bars.values[s].end());
  }
  for (const Mark& mark : bars.marks)
    values.push_back(mark.at);
  Axis y = bars.y;
  if (!y.logarithmic) values.push_back(0.0);
  // A bar starts at the beginning of the axis. A bar with a smaller value would cover the
  // labels.
  for (const double value : values) {
    if (y.logarithmic && y.from && value > 0.0) y.from = std::min(*y.from, value / kFoot);
  }
  Range range = range_of(y, values);
  if (!y.logarithmic && !y.from && range.from > -0.06 * (range.to - range.from)) range.from = 0.0;

  // The text of a line is beside the picture, because bars may be anywhere inside.
  std::size_t longest = 0;
  std::vector<Mark> lines = bars.marks;
  for (Mark& line : lines)
    longest = std::max(longest, std::exchange(line.text, {}).size());
  Frame frame(bars.title, bars.width, bars.height, legend,
              kMargin + kLabelLetter * static_cast<double>(longest));
  frame.y_axis(y, range);
  const double group = (frame.right() - frame.left()) / static_cast<double>(bars.labels.size());
  const double width = group * (1.0 - kGap) / static_cast<double>(bars.series.size());
  const double floor = y.logarithmic ? frame.bottom() : frame.y(0.0);
  for (std::size_t i = 0; i < bars.labels.size(); ++i) {
    const double begin = frame.left() + group * (static_cast<double>(i) + 0.5 * kGap);
    for (std::size_t s = 0; s < bars.series.size(); ++s) {
      const double top = frame.y(bars.values[s][i]);
      if (!std::isfinite(top)) continue;
      frame.add(fmt::format(
          "<rect class=\"fill {}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\">"
          "<title>{}, {}: {:.4g}</title></rect>\n",
          name(bars.inks[s % bars.inks.size()]), begin + width * static_cast<double>(s),
          std::min(top, floor), width, std::abs(floor - top), escaped(bars.labels[i]),
          escaped(bars.series[s]), bars.values[s][i]));
    }
    frame.add(fmt::format(
        "<text class=\"tick\" text-anchor=\"middle\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
        frame.left() + group * (static_cast<double>(i) + 0.5), frame.bottom() + 17.0,
        escaped(bars.labels[i])));
  }
  frame.marks(lines);
  for (const Mark& mark : bars.marks)
    frame.add(fmt::format("<text class=\"tick\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
                          frame.right() + 4.0, frame.y(mark.at) + 4.0, escaped(mark.text)));
  return frame.close();
}

}  // namespace shaker::report
