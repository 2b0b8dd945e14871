// The frame of a picture: title, axes, grid and legend, and the conversion of values to
// positions. Shared by the kinds of picture; private to report/plot/.
#pragma once

#include <string>
#include <vector>

#include <fmt/format.h>

#include "report/plot/plot.hpp"

namespace shaker::report {

struct LegendRow {
  std::string name, sample;  // sample: SVG of 22 by 12 px
};

class Frame {
 public:
  // `legend` is below the title and may be empty. `right_margin`, px, is the space right of the
  // axes.
  Frame(const std::string& title, int width, int height, const std::vector<LegendRow>& legend,
        double right_margin = 14.0);

  void axes(const Axis& x, const Range& x_range, const Axis& y, const Range& y_range);
  void y_axis(const Axis& y, const Range& y_range);
  void marks(const std::vector<Mark>& marks);
  void add(const std::string& svg) { body_ += svg; }
  std::string close();

  double left() const { return left_; }
  double right() const { return width_ - right_margin_; }
  double top() const { return top_; }
  double bottom() const { return height_ - 46.0; }
  double x(double value) const { return left() + x_.place(value) * (right() - left()); }
  double y(double value) const { return bottom() - y_.place(value) * (bottom() - top()); }
  void x_range(const Range& range) { x_ = range; }

 private:
  std::string body_;
  double width_, height_, right_margin_, left_ = 62.0, top_ = 34.0;
  Range x_, y_;
};

std::string_view name(Ink ink);  // CSS class

}  // namespace shaker::report
