// Responses that repeat only after two, three or m periods of the excitation.
//
// A PeriodicSystem does not know of the excitation's period: its ring spans whatever time the state
// repeats after. Put on m periods it has the frequency f / m and an excitation that repeats m times
// around it; every solution of one period is a solution there too, and the subharmonic ones are
// new. They are reached from a period doubling (Continuation::doubled) or from a measured record.
#pragma once

#include <span>
#include <vector>

#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

// amplitude * cos over each of `periods` excitation periods in the ring, each of 1 / frequency_hz.
void set_excitation_over(PeriodicSystem& system, int periods, double frequency_hz,
                         double amplitude);

// A state for the observed coordinate from a record over the whole ring on equal steps: its mean
// and first `harmonics` harmonics of the ring. Other coordinates keep what they have.
void start_from_record(PeriodicSystem& system, std::span<const double> record, int harmonics);

// The share of the motion that does not repeat after one excitation period: root of the energy of
// the harmonics that are no multiples of `periods` over that of all but the mean. 0: the solution
// is one of period 1, `periods` times around; a subharmonic response has some per cent or more.
double subharmonic_share(std::span<const double> record, int periods);
double subharmonic_share(const PeriodicSystem& system, int periods);

// Whether that share of a measured record is more than noise: noise is about as strong in all of
// the harmonics in between, a response in the first few.
bool subharmonic_stands_out(std::span<const double> record, int periods);

}  // namespace shaker::estimator
