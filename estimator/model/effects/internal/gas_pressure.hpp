// The gas force of gas_spring, P = theta2 (1 - theta3 u)^(-theta4), for effects whose formulas
// contain it.
#pragma once

#include <cmath>

#include "estimator/math/dual.hpp"
#include "estimator/model/effects/effect.hpp"

namespace shaker::estimator {

inline constexpr Borrowed kGasParameters[] = {
    {"gas_spring", "theta2"}, {"gas_spring", "theta3"}, {"gas_spring", "theta4"}};

// `gas`: theta2, theta3, theta4. Returns false at full compression of the gas
// (1 - theta3 u = 0).
template <class T>
bool gas_pressure(const T& u, const T* gas, T& pressure) {
  using std::exp;
  using std::log;
  const T column = 1.0 - gas[1] * u;
  if (!(column.value > 1e-9)) return false;
  pressure = gas[0] * exp(-gas[2] * log(column));
  return true;
}

}  // namespace shaker::estimator
