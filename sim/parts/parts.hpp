// The part entries that the files of this folder define, for table.cpp.
#pragma once

#include "sim/plant_part.hpp"

namespace shaker::sim {

// The parts that every plant of their kind has.
extern const PartEntry kOrificeDamping, kGasSpring, kGravity, kLinearOscillator, kBoucWenOscillator;

// Effects that a plant may hide; they are off by default.
extern const PartEntry kCoulombFriction, kPressureFriction, kViscousDamping, kLinearStiffness,
    kCubicStiffness, kEndStop, kReboundDamping, kLaminarOrifice, kMeteringPin, kCavitation,
    kBoucWenHysteresis, kPreslidingFriction, kReliefValve, kOilCompressibility, kSecondChamber,
    kRealGas, kAddedMass, kFreePlay, kTyre;

// Effects that are absent from the estimator's catalogue: a diagnosis must say that it cannot
// explain them.
extern const PartEntry kDetent, kNotchDamping, kLeaningBearing;
extern const PartEntry kWarmingOil, kLeakingGas;

}  // namespace shaker::sim
