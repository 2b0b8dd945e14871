// Uneven samples of one period onto n equal steps of the cyclic time, without a lag.
//
// Each point is the value at its own place of a cubic fitted by least squares to the samples within
// 1/n of a period on either side. Chosen for what the estimator assumes of its data:
//  - symmetric, so no phase lag, and exact for cubics: the bias is a m^4 / n^4 * 0.56 for a
//    harmonic of order m and amplitude a (3e-8 of a fundamental at n = 64);
//  - every sample is used, and folding is damped to 4 % of the white-noise power below half the new
//    rate, so that the noise of the points is nearly white with 1.125 n/N of the samples' variance,
//    which is also its power at the low harmonics that carry the parameters: standard errors
//    computed as if the points were independent are right within 4 % (tests hold both);
//  - the samples' own noise falls out of the residuals.
// Where fewer than eight samples lie in reach (a slow sensor), the eight nearest carry a quintic.
//
// Pure functions on preallocated memory; never allocate.
#pragma once

#include <span>

namespace shaker::daemon {

struct Resampled {
  bool ok = false;
  double sample_noise = 0.0;  // standard deviation of one sample about the curve
  double point_noise = 0.0;   // of one resampled point
  bool sparse = false;        // the quintic was needed somewhere
};

// `tau` ascending, in periods from the cycle's start, reaching 1/n (or four samples) beyond [0, 1 -
// 1/n] on both sides; out.size() = n. ok is false when a point has no samples on one of its sides.
Resampled resample(std::span<const double> tau, std::span<const double> value,
                   std::span<double> out);

// Time stamps that wander about a regular sampling clock, put back onto it. `t` ascending, in
// seconds; `smooth` gets the times on the clock. jitter is the wander's standard deviation in
// sample intervals. ok is false when the samples do not follow a regular clock (missing ones do not
// harm).
struct StampFit {
  bool ok = false;
  double interval = 0.0;
  double jitter = 0.0;
};
StampFit smooth_stamps(std::span<const double> t, std::span<double> smooth,
                       std::span<double> scratch);

}  // namespace shaker::daemon
