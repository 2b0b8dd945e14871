// One whole period of the excitation, resampled on equal steps of the cyclic time tau = t f.
#pragma once

#include <vector>

namespace shaker::estimator {

// n = displacement.size() points at tau_i = i / n; tau = 0 is the excitation's peak, or near it
// where its phase wanders: `excitation` is as it was, amplitude * cos(2 pi tau) when steady.
struct MeasuredCycle {
  int run = 0;                       // index of the run in the campaign
  long index = 0;                    // count of cycles in the run
  double frequency_hz = 0.0;         // measured, on the clock of the samples
  double amplitude = 0.0;            // of the excitation's fundamental, m/s^2
  std::vector<double> displacement;  // m
  std::vector<double> excitation;    // m/s^2; empty: a pure cosine of `amplitude`

  // Standard error of `amplitude`, and of amplitude times phase in rad, from the accelerometer's
  // noise; independent from cycle to cycle. 0: the excitation is known exactly.
  double excitation_error = 0.0;
};

}  // namespace shaker::estimator
