// The rows that the files of this folder offer to table.cpp.
#pragma once

#include "sim/plant_part.hpp"

namespace shaker::sim {

// The plants' bases.
extern const PartEntry kOrificeDamping, kGasSpring, kGravity, kLinearOscillator, kBoucWenOscillator;

// Effects that a base may hide; off by default.
extern const PartEntry kCoulombFriction, kPressureFriction, kViscousDamping, kLinearStiffness,
    kCubicStiffness, kEndStop, kReboundDamping, kLaminarOrifice, kMeteringPin, kCavitation,
    kBoucWenHysteresis, kPreslidingFriction, kReliefValve, kOilCompressibility, kSecondChamber,
    kRealGas, kAddedMass, kFreePlay, kTyre;

// Effects that no catalogue of the estimator has: what cannot be named must be said so.
extern const PartEntry kDetent, kNotchDamping, kLeaningBearing;
extern const PartEntry kWarmingOil, kLeakingGas;

}  // namespace shaker::sim
