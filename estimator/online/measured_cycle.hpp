/// \file
/// One whole period of the excitation, resampled on equal steps of the cyclic time tau = t f.
#pragma once

#include <vector>

namespace shaker::estimator {

/// n = displacement.size() points at tau_i = i / n. tau = 0 is the peak of the excitation, or near
/// it if the excitation's phase varies. `excitation` is as measured; when steady it is
/// amplitude * cos(2 pi tau).
struct MeasuredCycle {
  int run = 0;                       ///< index of the run in the campaign
  long index = 0;                    ///< number of the cycle in the run
  double frequency_hz = 0.0;         ///< measured, on the clock of the samples
  double amplitude = 0.0;            ///< of the excitation's fundamental, m/s^2
  std::vector<double> displacement;  ///< m
  std::vector<double> excitation;    ///< m/s^2; empty: a pure cosine of `amplitude`

  /// Standard error of `amplitude`, and of amplitude times phase (phase in rad), from the
  /// accelerometer's noise. Independent from cycle to cycle. 0: the excitation is known exactly.
  double excitation_error = 0.0;
};

}  // namespace shaker::estimator
