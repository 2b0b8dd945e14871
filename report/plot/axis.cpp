#include "report/plot/axis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace shaker::report {
namespace {

constexpr double kAir = 0.05;

bool drawable(double value, bool logarithmic) {
  return std::isfinite(value) && (!logarithmic || value > 0.0);
}

// The smallest of 1, 2, 5 times a power of ten that is not below `step`.
double round_step(double step) {
  const double power = std::pow(10.0, std::floor(std::log10(step)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= step * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

std::vector<Tick> linear_ticks(const Range& range, int wanted) {
  const double step = round_step((range.to - range.from) / wanted);
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  const bool powers = std::max(std::abs(range.from), std::abs(range.to)) >= 1e5 || decimals > 4;
  std::vector<Tick> ticks;
  const auto first = static_cast<long>(std::ceil(range.from / step - 1e-9));
  const auto last = static_cast<long>(std::floor(range.to / step + 1e-9));
  for (long k = first; k <= last; ++k) {
    const double value = static_cast<double>(k) * step;
    ticks.push_back({value, powers ? fmt::format("{:.3g}", value)
                                   : fmt::format("{:.{}f}", value == 0.0 ? 0.0 : value, decimals)});
  }
  return ticks;
}

std::vector<Tick> decade_ticks(const Range& range, int wanted) {
  const double decades = std::log10(range.to / range.from);
  const int stride = std::max(1, static_cast<int>(std::ceil(decades / wanted)));
  std::vector<double> within{1.0};
  if (decades * 3 <= wanted + 1) within = {1.0, 2.0, 5.0};
  std::vector<Tick> ticks;
  const int first = static_cast<int>(std::floor(std::log10(range.from)));
  for (int power = first; std::pow(10.0, power) <= range.to * (1 + 1e-9); power += stride) {
    for (const double factor : within) {
      const double value = factor * std::pow(10.0, power);
      if (value < range.from * (1 - 1e-9) || value > range.to * (1 + 1e-9)) continue;
      ticks.push_back({value, fmt::format("{:.5g}", value)});
    }
  }
  return ticks;
}

}  // namespace

double Range::place(double value) const {
  if (!drawable(value, logarithmic)) return std::numeric_limits<double>::quiet_NaN();
  return logarithmic ? std::log(value / from) / std::log(to / from) : (value - from) / (to - from);
}

Range range_of(const Axis& axis, std::span<const double> values) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double value : values) {
    if (!drawable(value, axis.logarithmic)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (low > high) {
    low = axis.from.value_or(axis.logarithmic ? 0.1 : 0.0);
    high = axis.to.value_or(axis.logarithmic ? 10.0 * low : low + 1.0);
  }
  if (low == high) {
    const double half = low == 0.0 ? 1.0 : 0.5 * std::abs(low);
    low -= half;
    high += half;
  }
  if (axis.logarithmic) {
    const double air = std::pow(high / low, kAir);
    return {axis.from.value_or(low / air), axis.to.value_or(high * air), true};
  }
  const double air = kAir * (high - low);
  Range range{axis.from.value_or(low - air), axis.to.value_or(high + air), false};
  if (!(range.from < range.to)) range.to = range.from + 1.0;
  return range;
}

std::vector<Tick> ticks_of(const Range& range, int wanted) {
  return range.logarithmic ? decade_ticks(range, wanted) : linear_ticks(range, wanted);
}

}  // namespace shaker::report
