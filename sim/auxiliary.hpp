// The auxiliary quantities of the virtual rig: what a laboratory measures besides the stroke
// and the table's acceleration. They are recorded; the estimator does not use them.
//
// Each quantity is computed from the same true motion as the main channels and has a transducer
// with its own noise and quantisation step (table in auxiliary.cpp). The equation of motion is
// written per unit mass, but forces and pressures need a size: kMass and kPistonArea. The oil
// warms with the work that the damper absorbs.
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

// The true state of the rig at one sampling instant.
struct AuxiliaryTruth {
  double t = 0.0;                  // s
  double u = 0.0, v = 0.0;         // stroke, m, and its velocity, m/s
  double sprung = 0.0;             // upward acceleration of the mass, m/s^2
  double weight = 0.0, gas = 0.0;  // per unit mass, m/s^2
  const TableMotion& table;
};

struct AuxiliaryQuantity {
  std::string_view name, unit, meaning;
  double noise, quantum;  // standard deviation and quantisation step, in `unit`
};
// All quantities that exist; at most kAuxiliaryMost rows.
std::span<const AuxiliaryQuantity> auxiliary_table();

class Auxiliary {
 public:
  // `wanted`: names of the quantities, in the order in which `take` returns them. Throws
  // std::invalid_argument that names an unknown quantity, or when there are more than
  // kAuxiliaryMost.
  Auxiliary(std::span<const std::string> wanted, std::uint64_t seed);

  bool empty() const { return wanted_.empty(); }
  // Measures all wanted quantities at `truth.t` and warms the oil up to that time; so the times
  // must not decrease. Unused places of the result are 0.
  AuxiliaryValues take(const AuxiliaryTruth& truth);

 private:
  void warm(const AuxiliaryTruth& truth);

  std::vector<std::size_t> wanted_;  // rows of the table
  double oil_, last_t_ = 0.0;
  std::mt19937_64 noise_source_;  // of its own: the noise of the other channels does not change
  std::normal_distribution<double> normal_;
};

}  // namespace shaker::sim
