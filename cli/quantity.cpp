#include "cli/quantity.hpp"

#include <charconv>
#include <cmath>

#include <fmt/format.h>

namespace shaker::cli {

Result<double> quantity(const std::string& what, const std::string& text, Dimension dimension) {
  double number = 0.0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  const auto refused = [&](const std::string& why) {
    return Error{ErrorKind::invalid, fmt::format("{} {}: {}", what, text, why)};
  };
  if (read.ec != std::errc() || !std::isfinite(number))
    return refused(
        fmt::format("does not begin with a number; say for example \"12{}\"", si_unit(dimension)));
  std::string unit = text.substr(static_cast<std::size_t>(read.ptr - text.data()));
  unit.erase(0, unit.find_first_not_of(' '));
  if (unit.empty())
    return refused(fmt::format("has no unit; put one behind the number: {}", units_of(dimension)));
  const auto known = unit_called(unit, dimension);
  if (!known)
    return refused(
        fmt::format("\"{}\" is not a unit for this; known are {}", unit, units_of(dimension)));
  return known->to_si(number);
}

}  // namespace shaker::cli
