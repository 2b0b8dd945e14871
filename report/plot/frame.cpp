#include "report/plot/frame.hpp"

#include <algorithm>

namespace shaker::report {
namespace {

constexpr double kLetter = 6.4;  // average width of a letter of 12 px

double legend_width(const LegendRow& row) {
  return 30.0 + kLetter * static_cast<double>(row.name.size()) + 14.0;
}

}  // namespace

std::string_view name(Ink ink) {
  constexpr std::string_view names[] = {"ink1", "ink2", "ink3", "ink4", "quiet"};
  return names[static_cast<int>(ink)];
}

Frame::Frame(const std::string& title, int width, int height, const std::vector<LegendRow>& legend,
             double right_margin)
    : width_(width), height_(height), right_margin_(right_margin) {
  body_ = fmt::format(
      "<svg class=\"plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" "
      "width=\"{0}\" height=\"{1}\" role=\"img\"><title>{2}</title>\n"
      "<text class=\"title\" x=\"14\" y=\"20\">{2}</text>\n",
      width, height, escaped(title));
  double x = 14.0;
  for (const LegendRow& row : legend) {
    if (x > 14.0 && x + legend_width(row) > width_) {
      x = 14.0;
      top_ += 17.0;
    }
    body_ += fmt::format(
        "<g transform=\"translate({:.1f} {:.1f})\">{}<text x=\"27\" y=\"10\">{}</text></g>\n", x,
        top_ - 4.0, row.sample, escaped(row.name));
    x += legend_width(row);
  }
  if (!legend.empty()) top_ += 20.0;
}

void Frame::y_axis(const Axis& y, const Range& y_range) {
  y_ = y_range;
  for (const Tick& tick : ticks_of(y_range, 6)) {
    const double at = this->y(tick.value);
    body_ += fmt::format("<path class=\"grid\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>", left(), at, right());
    body_ += fmt::format(
        "<text class=\"tick\" text-anchor=\"end\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
        left() - 6.0, at + 4.0, tick.text);
  }
  const double middle = 0.5 * (top() + bottom());
  body_ += fmt::format(
      "<text class=\"label\" text-anchor=\"middle\" transform=\"translate(15 {:.1f}) rotate(-90)\">"
      "{}</text>\n",
      middle, escaped(y.label));
}

void Frame::axes(const Axis& x, const Range& x_range, const Axis& y, const Range& y_range) {
  x_ = x_range;
  for (const Tick& tick : ticks_of(x_range, std::max(3, static_cast<int>(width_ / 80.0)))) {
    const double at = this->x(tick.value);
    body_ += fmt::format("<path class=\"grid\" d=\"M{:.1f} {:.1f}V{:.1f}\"/>", at, top(), bottom());
    body_ += fmt::format(
        "<text class=\"tick\" text-anchor=\"middle\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", at,
        bottom() + 17.0, tick.text);
  }
  body_ += fmt::format(
      "<text class=\"label\" text-anchor=\"middle\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
      0.5 * (left() + right()), height_ - 10.0, escaped(x.label));
  y_axis(y, y_range);
}

void Frame::marks(const std::vector<Mark>& marks) {
  for (const Mark& mark : marks) {
    const double at = mark.vertical ? x(mark.at) : y(mark.at);
    if (mark.vertical ? !(at >= left() && at <= right()) : !(at >= top() && at <= bottom()))
      continue;
    body_ += mark.vertical
                 ? fmt::format(
                       "<path class=\"mark\" d=\"M{0:.1f} {1:.1f}V{2:.1f}\"/>"
                       "<text class=\"tick said\" x=\"{3:.1f}\" y=\"{4:.1f}\">{5}</text>\n",
                       at, top(), bottom(), at + 4.0, top() + 11.0, escaped(mark.text))
                 : fmt::format(
                       "<path class=\"mark\" d=\"M{0:.1f} {1:.1f}H{2:.1f}\"/>"
                       "<text class=\"tick said\" text-anchor=\"end\" x=\"{3:.1f}\" "
                       "y=\"{4:.1f}\">{5}</text>\n",
                       left(), at, right(), right() - 4.0, at - 4.0, escaped(mark.text));
  }
}

std::string Frame::close() {
  body_ += fmt::format("<path class=\"axis\" d=\"M{0:.1f} {1:.1f}V{2:.1f}H{3:.1f}\"/>\n</svg>\n",
                       left(), top(), bottom(), right());
  return body_;
}

}  // namespace shaker::report
