// The remaining height of the gas column, 1 - theta3 u, as a fraction of its height at full
// extension.
#pragma once

#include <algorithm>

namespace shaker::sim {

inline constexpr double kLeastGasColumn = 0.005;

// The result stays positive beyond the wall, so that a trial step of the integrator stays
// finite. The integrator then stops at Plant::wall().
inline double gas_column(double theta3, double u) {
  return std::max(1.0 - theta3 * u, 0.5 * kLeastGasColumn);
}

}  // namespace shaker::sim
