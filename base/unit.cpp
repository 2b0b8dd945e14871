#include "base/unit.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <numbers>
#include <utility>

#include <fmt/format.h>

namespace shaker {
namespace {

using enum Dimension;

// NIST Special Publication 811, appendix B; in, ft, lbf and the standard acceleration are exact.
constexpr double kInch = 0.0254, kFoot = 0.3048, kGravity = 9.80665, kPoundForce = 4.4482216152605;
constexpr double kFahrenheit = 5.0 / 9.0, kIcePoint = 273.15;

// The SI unit of a dimension comes first.
constexpr std::array kUnits = {
    Unit{"m", length, 1.0},
    Unit{"cm", length, 1e-2},
    Unit{"mm", length, 1e-3},
    Unit{"um", length, 1e-6},
    Unit{"in", length, kInch},
    Unit{"ft", length, kFoot},
    Unit{"m/s", speed, 1.0},
    Unit{"cm/s", speed, 1e-2},
    Unit{"mm/s", speed, 1e-3},
    Unit{"in/s", speed, kInch},
    Unit{"ft/s", speed, kFoot},
    Unit{"km/h", speed, 1.0 / 3.6},
    Unit{"m/s^2", acceleration, 1.0},
    Unit{"cm/s^2", acceleration, 1e-2},
    Unit{"mm/s^2", acceleration, 1e-3},
    Unit{"um/s^2", acceleration, 1e-6},
    Unit{"in/s^2", acceleration, kInch},
    Unit{"ft/s^2", acceleration, kFoot},
    Unit{"g", acceleration, kGravity},
    Unit{"N", force, 1.0},
    Unit{"kN", force, 1e3},
    Unit{"MN", force, 1e6},
    Unit{"kgf", force, kGravity},
    Unit{"lbf", force, kPoundForce},
    Unit{"klbf", force, 1e3 * kPoundForce},
    Unit{"Pa", pressure, 1.0},
    Unit{"kPa", pressure, 1e3},
    Unit{"MPa", pressure, 1e6},
    Unit{"mbar", pressure, 1e2},
    Unit{"bar", pressure, 1e5},
    Unit{"atm", pressure, 101325.0},
    Unit{"psi", pressure, kPoundForce / (kInch * kInch)},
    Unit{"lbf/ft^2", pressure, kPoundForce / (kFoot * kFoot)},
    Unit{"kgf/m^2", pressure, kGravity},
    Unit{"K", temperature, 1.0},
    Unit{"degC", temperature, 1.0, kIcePoint},
    Unit{"degF", temperature, kFahrenheit, kIcePoint - 32.0 * kFahrenheit},
    Unit{"rad", angle, 1.0},
    Unit{"mrad", angle, 1e-3},
    Unit{"deg", angle, std::numbers::pi / 180.0},
    Unit{"s", Dimension::time, 1.0},
    Unit{"ms", Dimension::time, 1e-3},
    Unit{"us", Dimension::time, 1e-6},
    Unit{"min", Dimension::time, 60.0},
    Unit{"Hz", frequency, 1.0},
    Unit{"kHz", frequency, 1e3},
    Unit{"rpm", frequency, 1.0 / 60.0},
    Unit{"rad/s", frequency, 0.5 * std::numbers::inv_pi},
};

constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kSpellings = {{
    {"m/s2", "m/s^2"},
    {"m/s²", "m/s^2"},
    {"m/s/s", "m/s^2"},
    {"mm/s2", "mm/s^2"},
    {"mm/s²", "mm/s^2"},
    {"µm", "um"},  // the micro sign
    {"μm", "um"},  // the Greek letter
    {"°C", "degC"},
    {"°F", "degF"},
    {"°", "deg"},
    {"µs", "us"},
    {"1/min", "rpm"},
    {"lb/ft^2", "lbf/ft^2"},
    {"psf", "lbf/ft^2"},
}};

}  // namespace

std::optional<Unit> unit_called(std::string_view name) {
  const auto* other =
      std::ranges::find(kSpellings, name, &std::pair<std::string_view, std::string_view>::first);
  const std::string_view wanted = other == kSpellings.end() ? name : other->second;
  const auto* found = std::ranges::find(kUnits, wanted, &Unit::name);
  return found == kUnits.end() ? std::nullopt : std::optional(*found);
}

std::optional<Unit> unit_called(std::string_view name, Dimension dimension) {
  const auto found = unit_called(name);
  return found && found->dimension == dimension ? found : std::nullopt;
}

std::optional<Conversion> conversion(std::string_view from, std::string_view to) {
  if (from == to) return Conversion{};
  const auto source = unit_called(from), target = unit_called(to);
  if (!source || !target || source->dimension != target->dimension) return std::nullopt;
  return Conversion{source->scale / target->scale, target->from_si(source->offset)};
}

std::string_view si_unit(Dimension dimension) {
  return std::ranges::find(kUnits, dimension, &Unit::dimension)->name;
}

std::vector<Unit> units_with(Dimension dimension) {
  std::vector<Unit> found;
  std::ranges::copy_if(kUnits, std::back_inserter(found),
                       [&](const Unit& unit) { return unit.dimension == dimension; });
  return found;
}

std::string units_of(Dimension dimension) {
  std::string names;
  for (const Unit& unit : units_with(dimension))
    names += fmt::format("{}{}", names.empty() ? "" : ", ", unit.name);
  return names;
}

std::string units_like(std::string_view name) {
  const auto unit = unit_called(name);
  return unit ? units_of(unit->dimension) : std::string(name);
}

}  // namespace shaker
