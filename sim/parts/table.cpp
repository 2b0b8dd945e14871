#include "sim/parts/parts.hpp"

namespace shaker::sim {

std::span<const PartEntry> part_table() {
  static const PartEntry rows[] = {kOrificeDamping,
                                   kGasSpring,
                                   kGravity,
                                   kLinearOscillator,
                                   kBoucWenOscillator,
                                   kCoulombFriction,
                                   kPressureFriction,
                                   kViscousDamping,
                                   kLinearStiffness,
                                   kCubicStiffness,
                                   kEndStop,
                                   kReboundDamping,
                                   kLaminarOrifice,
                                   kMeteringPin,
                                   kCavitation,
                                   kBoucWenHysteresis,
                                   kPreslidingFriction,
                                   kReliefValve,
                                   kOilCompressibility,
                                   kSecondChamber,
                                   kRealGas,
                                   kAddedMass,
                                   kFreePlay,
                                   kTyre,
                                   kDetent,
                                   kNotchDamping,
                                   kLeaningBearing,
                                   kWarmingOil,
                                   kLeakingGas};
  return rows;
}

}  // namespace shaker::sim
