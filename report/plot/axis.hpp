// One axis of a picture: its range, its scale and its ticks.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace shaker::report {

struct Axis {
  std::string label;           // with the unit: "stroke, mm"
  std::optional<double> from;  // otherwise from the data
  std::optional<double> to;
  bool logarithmic = false;  // values that are not positive are not drawn
};

struct Tick {
  double value = 0.0;
  std::string text;
};

// A range that can be drawn: finite, from < to, positive on a logarithmic axis.
struct Range {
  double from = 0.0, to = 1.0;
  bool logarithmic = false;
  // The position of a value: 0 at `from`, 1 at `to`, outside of 0 to 1 for values outside the
  // range. NaN for a value without a position.
  double place(double value) const;
};

// The range of the axis over these values: `from` and `to` if given, otherwise the extremes of
// the finite values with a margin of a twentieth on both sides. Never empty.
Range range_of(const Axis& axis, std::span<const double> values);

// About `wanted` round numbers (1, 2, 5 times a power of ten; on a logarithmic axis decades,
// and 2 and 5 times them if there is room), with as many digits as distinguish them.
std::vector<Tick> ticks_of(const Range& range, int wanted);

}  // namespace shaker::report
