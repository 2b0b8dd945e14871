// What a laboratory measures beside stroke and table: recorded for later, never estimated from.
//
// Quantities of the same truth, each with a transducer of its own (noise and resolution fixed in
// the table of auxiliary.cpp). Forces and pressures need a size, which the equation of motion per
// unit mass does not: kMass and kPistonArea. The oil warms with the work that the damper takes up.
#pragma once

#include <array>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim/plant_part.hpp"
#include "sim/table_motion.hpp"

namespace shaker::sim {

inline constexpr double kMass = 500.0;         // kg, on the damper
inline constexpr double kPistonArea = 5.0e-3;  // m^2, of the gas column
inline constexpr std::size_t kAuxiliaryMost = 8;

using AuxiliaryValues = std::array<double, kAuxiliaryMost>;

// One sampling of the truth.
struct AuxiliaryTruth {
  double t = 0.0;                  // s
  double u = 0.0, v = 0.0;         // stroke
  double sprung = 0.0;             // upward acceleration of the mass, m/s^2
  double weight = 0.0, gas = 0.0;  // per unit mass, m/s^2
  const TableMotion& table;
};

struct AuxiliaryQuantity {
  std::string_view name, unit, meaning;
  double noise, quantum;  // of its transducer, in `unit`
};
// Every quantity there is, at most kAuxiliaryMost.
std::span<const AuxiliaryQuantity> auxiliary_table();

class Auxiliary {
 public:
  // The quantities wanted, in the order in which `take` gives them. Throws std::invalid_argument
  // naming one that is unknown, or when there are too many.
  Auxiliary(std::span<const std::string> wanted, std::uint64_t seed);

  bool empty() const { return wanted_.empty(); }
  // Values after the wanted ones are 0.
  AuxiliaryValues take(const AuxiliaryTruth& truth);

 private:
  void warm(const AuxiliaryTruth& truth);

  std::vector<std::size_t> wanted_;  // rows of the table
  double oil_, last_t_ = 0.0;
  std::mt19937_64 noise_source_;  // its own: the other channels stay as they were
  std::normal_distribution<double> normal_;
};

}  // namespace shaker::sim
