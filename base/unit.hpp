// The units that files may use, in one table for rig file, DBC, campaign, model and CSV.
//
// The program uses SI units only. A value is converted when its file is read. A unit that is
// not in the table is refused with the list of the known ones (`units_of`), unless the file
// gives its size.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace shaker {

enum class Dimension {
  length,
  speed,
  acceleration,
  force,
  pressure,
  temperature,
  angle,
  time,
  frequency,
};

// value in the SI unit = scale * value in this unit + offset.
struct Unit {
  std::string_view name;
  Dimension dimension = Dimension::length;
  double scale = 1.0;
  double offset = 0.0;  // 0 except for degC and degF

  double to_si(double value) const { return scale * value + offset; }
  double from_si(double value) const { return (value - offset) / scale; }
};

// Finds a unit; also accepts the spellings m/s2, m/s², µm, °C, 1/min and others. Empty if
// unknown.
std::optional<Unit> unit_called(std::string_view name);
// The same, restricted to units of that dimension.
std::optional<Unit> unit_called(std::string_view name, Dimension dimension);
// Conversion of values from one unit to another of the same dimension: to = scale * from +
// offset. Empty if a unit is unknown or the dimensions differ; equal names always give the
// identity.
struct Conversion {
  double scale = 1.0, offset = 0.0;
};
std::optional<Conversion> conversion(std::string_view from, std::string_view to);
// m, m/s, m/s^2, N, Pa, K, rad, s, Hz.
std::string_view si_unit(Dimension dimension);
// The units of a dimension, the SI unit first.
std::vector<Unit> units_with(Dimension dimension);
// "m, cm, mm, um, in, ft", for the message that refuses another unit. units_like takes a unit's
// name and lists the units of its dimension.
std::string units_of(Dimension dimension);
std::string units_like(std::string_view name);

}  // namespace shaker
