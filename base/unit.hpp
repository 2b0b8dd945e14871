// The units that a file may state, in one table: rig file, DBC, campaign, model and CSV read it.
//
// Everything inside the program is in SI units. A unit is converted where a file is read, so that
// nothing behind it knows of any other. A unit that is not in the table is refused with the list of
// those that are (`units_of`), or stated with its size.
#pragma once

#include <optional>
#include <string>
#include <string_view>

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
  double offset = 0.0;  // not 0 for degC and degF alone

  double to_si(double value) const { return scale * value + offset; }
  double from_si(double value) const { return (value - offset) / scale; }
};

// Other spellings are known too: m/s2, m/s², µm, °C, 1/min. Nothing where the name is in no table.
std::optional<Unit> unit_called(std::string_view name);
// The same, where it has to be a unit of that dimension.
std::optional<Unit> unit_called(std::string_view name, Dimension dimension);
// What leads from values in one unit to values in another of the same dimension: to = scale * from
// + offset. Nothing where one is not known or the dimensions differ; the same name always leads to
// itself.
struct Conversion {
  double scale = 1.0, offset = 0.0;
};
std::optional<Conversion> conversion(std::string_view from, std::string_view to);
// m, m/s, m/s^2, N, Pa, K, rad, s, Hz.
std::string_view si_unit(Dimension dimension);
// "m, cm, mm, um, in, ft", for the sentence that refuses another; by name, those of its dimension.
std::string units_of(Dimension dimension);
std::string units_like(std::string_view name);

}  // namespace shaker
