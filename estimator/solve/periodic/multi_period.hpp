// Subharmonic responses: they repeat only after m = 2, 3, ... periods of the excitation.
//
// The ring of a PeriodicSystem spans the period of the state, not that of the excitation. Over m
// periods it has the frequency f / m, and the excitation repeats m times. Every solution of one
// period is a solution there too; the subharmonic ones are new. They start from a period doubling
// (Continuation::doubled) or from a measured record.
#pragma once

#include <span>
#include <vector>

#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

// Sets the excitation to amplitude * cos over `periods` periods of 1 / frequency_hz in the ring.
void set_excitation_over(PeriodicSystem& system, int periods, double frequency_hz,
                         double amplitude);

// Sets the state of the observed coordinate to the mean and the first `harmonics` harmonics of the
// ring in `record` (equal steps over the whole ring). Other coordinates are unchanged.
void start_from_record(PeriodicSystem& system, std::span<const double> record, int harmonics);

// Returns the share of the motion that does not repeat after one excitation period: the square root
// of the energy in harmonics of the ring that are no multiples of `periods`, divided by the energy
// of all harmonics without the mean. It is 0 for a solution of period 1; a subharmonic response has
// several per cent or more.
double subharmonic_share(std::span<const double> record, int periods);
double subharmonic_share(const PeriodicSystem& system, int periods);

// Tests if the subharmonics of a measured record exceed the noise. Noise has about the same energy
// in all subharmonics; a response is concentrated in the first few.
bool subharmonic_stands_out(std::span<const double> record, int periods);

}  // namespace shaker::estimator
