#include "sim/auxiliary.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace shaker::sim {
namespace {

constexpr double kRoom = 20.0;            // degC
constexpr double kHeatCapacity = 2000.0;  // J/K, of one litre of oil
constexpr double kCooling = 12.0;         // W/K, from the oil to the room

// In the order of kTable.
enum Row { pressure, oil, force, mass, table_2, table_speed, table_place, speed };
constexpr AuxiliaryQuantity kTable[] = {
    {"gas_pressure", "Pa", "absolute, of the gas column", 200.0, 50.0},
    {"oil_temperature", "degC", "warms with the work done on the damper", 0.02, 0.01},
    {"damper_force", "N", "load cell under the damper, compression positive", 2.0, 0.5},
    {"mass_acceleration", "m/s^2", "upward, of the mass on the damper", 0.01, 1e-4},
    {"table_acceleration_2", "m/s^2", "second accelerometer on the table, upward", 0.01, 1e-4},
    {"table_velocity", "m/s", "upward", 1e-4, 1e-5},
    {"table_position", "m", "upward, from its mean", 2e-5, 1e-6},
    {"stroke_velocity", "m/s", "velocity transducer of the damper", 1e-3, 1e-4}};
static_assert(std::size(kTable) <= kAuxiliaryMost);

std::size_t find_row(const std::string& name) {
  const auto found = std::ranges::find(kTable, name, &AuxiliaryQuantity::name);
  if (found == std::end(kTable)) {
    std::vector<std::string_view> names;
    for (const auto& row : kTable)
      names.push_back(row.name);
    throw std::invalid_argument(fmt::format("auxiliary quantity '{}' is unknown; choose of {}",
                                            name, fmt::join(names, ", ")));
  }
  return static_cast<std::size_t>(found - std::begin(kTable));
}

double value_of(std::size_t row, const AuxiliaryTruth& now, double oil_temperature) {
  switch (static_cast<Row>(row)) {
    case pressure:
      return kMass * now.gas / kPistonArea;
    case oil:
      return oil_temperature;
    case force:
      return kMass * (now.sprung + now.weight);
    case mass:
      return now.sprung;
    case table_2:
      return now.table.acceleration(now.t);
    case table_speed:
      return now.table.velocity(now.t);
    case table_place:
      return now.table.position(now.t);
    case speed:
      return now.v;
  }
  return 0.0;
}

}  // namespace

std::span<const AuxiliaryQuantity> auxiliary_table() {
  return kTable;
}

Auxiliary::Auxiliary(std::span<const std::string> wanted, std::uint64_t seed)
    : oil_(kRoom), noise_source_(seed ^ 0xc2b2ae3d27d4eb4fu) {
  if (wanted.size() > kAuxiliaryMost) {
    throw std::invalid_argument(
        fmt::format("{} auxiliary quantities are wanted; at most {} are "
                    "allowed",
                    wanted.size(), kAuxiliaryMost));
  }
  for (const auto& name : wanted)
    wanted_.push_back(find_row(name));
}

// The work on the gas and on the weight cancels over a period; the rest becomes heat.
void Auxiliary::warm(const AuxiliaryTruth& now) {
  const double step = now.t - last_t_;
  last_t_ = now.t;
  const double power = kMass * now.sprung * now.v;
  oil_ += step * (power - kCooling * (oil_ - kRoom)) / kHeatCapacity;
}

AuxiliaryValues Auxiliary::take(const AuxiliaryTruth& now) {
  warm(now);
  AuxiliaryValues values{};
  for (std::size_t i = 0; i < wanted_.size(); ++i) {
    const AuxiliaryQuantity& row = kTable[wanted_[i]];
    const double noisy = value_of(wanted_[i], now, oil_) + row.noise * normal_(noise_source_);
    values[i] = std::round(noisy / row.quantum) * row.quantum;
  }
  return values;
}

}  // namespace shaker::sim
