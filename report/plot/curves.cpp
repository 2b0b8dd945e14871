// Draws curves, bands and points over two axes.
#include <cmath>
#include <iterator>
#include <span>

#include "report/plot/frame.hpp"

namespace shaker::report {
namespace {

// An SVG path that is interrupted at a value without a position.
std::string path_of(const Frame& frame, std::span<const double> x, std::span<const double> y,
                    bool steps) {
  std::string d;
  bool pen_down = false;
  double last = 0.0;
  for (std::size_t i = 0; i < x.size() && i < y.size(); ++i) {
    const double px = frame.x(x[i]), py = frame.y(y[i]);
    if (!std::isfinite(px) || !std::isfinite(py)) {
      pen_down = false;
      continue;
    }
    if (steps && pen_down) fmt::format_to(std::back_inserter(d), "L{:.1f} {:.1f}", px, last);
    fmt::format_to(std::back_inserter(d), "{}{:.1f} {:.1f}", pen_down ? 'L' : 'M', px, py);
    pen_down = true;
    last = py;
  }
  return d;
}

std::string drawn(const Frame& frame, const Curve& curve) {
  if (curve.stroke == Stroke::points) {
    std::string dots;
    for (std::size_t i = 0; i < curve.x.size() && i < curve.y.size(); ++i) {
      const double px = frame.x(curve.x[i]), py = frame.y(curve.y[i]);
      if (!std::isfinite(px) || !std::isfinite(py)) continue;
      fmt::format_to(std::back_inserter(dots), "M{:.1f} {:.1f}h0", px, py);
    }
    return fmt::format("<path class=\"dots {}\" d=\"{}\"/>\n", name(curve.ink), dots);
  }
  return fmt::format("<path class=\"curve {}{}\" d=\"{}\"/>\n", name(curve.ink),
                     curve.stroke == Stroke::dashed ? " dashed" : "",
                     path_of(frame, curve.x, curve.y, curve.stroke == Stroke::steps));
}

std::string drawn(const Frame& frame, const Band& band) {
  std::string d = path_of(frame, band.x, band.upper, false);
  const std::vector<double> x(band.x.rbegin(), band.x.rend());
  const std::vector<double> y(band.lower.rbegin(), band.lower.rend());
  std::string back = path_of(frame, x, y, false);
  if (d.empty() || back.empty()) return {};
  back.front() = 'L';
  return fmt::format("<path class=\"band {}\" d=\"{}{}Z\"/>\n", name(band.ink), d, back);
}

std::string sample(const Curve& curve) {
  if (curve.stroke == Stroke::points)
    return fmt::format("<path class=\"dots {}\" d=\"M4 6h0M11 6h0M18 6h0\"/>", name(curve.ink));
  return fmt::format("<path class=\"curve {}{}\" d=\"M0 6H22\"/>", name(curve.ink),
                     curve.stroke == Stroke::dashed ? " dashed" : "");
}

void append(std::vector<double>& to, const std::vector<double>& values) {
  to.insert(to.end(), values.begin(), values.end());
}

}  // namespace

std::string to_svg(const Plot& plot) {
  std::vector<LegendRow> legend;
  std::vector<double> xs, ys;
  for (const Curve& curve : plot.curves) {
    if (!curve.name.empty()) legend.push_back({curve.name, sample(curve)});
    append(xs, curve.x);
    append(ys, curve.y);
  }
  for (const Band& band : plot.bands) {
    if (!band.name.empty()) {
      legend.push_back(
          {band.name,
           fmt::format("<rect class=\"band {}\" width=\"22\" height=\"12\"/>", name(band.ink))});
    }
    append(xs, band.x);
    append(ys, band.lower);
    append(ys, band.upper);
  }
  Frame frame(plot.title, plot.width, plot.height, legend);
  frame.axes(plot.x, range_of(plot.x, xs), plot.y, range_of(plot.y, ys));
  for (const Band& band : plot.bands)
    frame.add(drawn(frame, band));
  for (const Curve& curve : plot.curves)
    frame.add(drawn(frame, curve));
  frame.marks(plot.marks);
  return frame.close();
}

}  // namespace shaker::report
