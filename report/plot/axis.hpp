// One axis of a picture: its range, its scale, its ticks.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace shaker::report {

struct Axis {
  std::string label;           // with the unit: "stroke, mm"
  std::optional<double> from;  // else: what the data need
  std::optional<double> to;
  bool logarithmic = false;  // values that are not positive are not drawn
};

struct Tick {
  double value = 0.0;
  std::string text;
};

// A range that is ready to be drawn: finite, from < to, positive on a logarithmic axis.
struct Range {
  double from = 0.0, to = 1.0;
  bool logarithmic = false;
  // Place of a value, 0 at `from`, 1 at `to`; outside of that where the value is. NaN for one that
  // has no place.
  double place(double value) const;
};

// The axis' range over these values: `from` and `to` where given, else the finite values' extremes
// with a twentieth of air on either side. Never empty.
Range range_of(const Axis& axis, std::span<const double> values);

// About `wanted` round numbers (1, 2, 5 times a power of ten; on a logarithmic axis, decades and
// their 2 and 5 where there is room), with as many digits as tell them apart.
std::vector<Tick> ticks_of(const Range& range, int wanted);

}  // namespace shaker::report
