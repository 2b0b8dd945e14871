// Frequency and phase of the driver of a run, and where its amplitude is steady.
#pragma once

#include <vector>

namespace shaker::estimator::diagnosis {

// turn(t) = frequency * t + offset. It is an integer at the crests of the fundamental. [from, to)
// is the longest time in which the amplitude of the fundamental stays the same.
struct PhaseFit {
  bool ok = false;
  double frequency_hz = 0.0, offset = 0.0;
  double amplitude = 0.0;
  double from = 0.0, to = 0.0;
  double turn(double t) const { return frequency_hz * t + offset; }
};

// `nominal_hz` must be right to a few per cent. Not ok when there is no fundamental.
PhaseFit fit_phase(const std::vector<double>& t, const std::vector<double>& driver,
                   double nominal_hz);

}  // namespace shaker::estimator::diagnosis
