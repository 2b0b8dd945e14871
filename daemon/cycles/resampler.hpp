// Resamples uneven samples of one period onto n equal steps of the cyclic time, without a lag.
//
// Each point is the value of a cubic, fitted by least squares to the samples within 1/n of a
// period on either side. Properties that the estimator needs:
//  - The fit is symmetric, so it has no phase lag, and it is exact for cubics: the bias is
//    a m^4 / n^4 * 0.56 for a harmonic of order m and amplitude a (3e-8 of a fundamental at
//    n = 64).
//  - It uses every sample, and aliasing is damped to 4 % of the white-noise power below half the
//    new rate. The noise of the points is therefore nearly white with 1.125 n/N of the samples'
//    variance, which is also its power at the low harmonics that carry the parameters. Standard
//    errors that assume independent points are right within 4 % (tests check both).
//  - The residuals give the noise of the samples.
// If fewer than eight samples are in reach (a slow sensor), a quintic is fitted to the nearest
// eight.
//
// Pure functions on preallocated memory; they never allocate.
#pragma once

#include <span>

namespace shaker::daemon {

struct Resampled {
  bool ok = false;
  double sample_noise = 0.0;  // standard deviation of one sample about the curve
  double point_noise = 0.0;   // of one resampled point
  bool sparse = false;        // a quintic was used somewhere
};

// `tau` is ascending, in periods from the start of the cycle, and extends 1/n (or four samples)
// beyond [0, 1 - 1/n] on both sides; out.size() = n. ok is false if a point has no samples on
// one side.
Resampled resample(std::span<const double> tau, std::span<const double> value,
                   std::span<double> out);

// Moves time stamps with jitter back onto a regular sampling clock. `t` is ascending, in s;
// `smooth` receives the times on the clock; `scratch` has at least the size of `t`. jitter is
// its standard deviation in sample intervals. ok is false if the samples do not follow a
// regular clock; missing samples are allowed.
struct StampFit {
  bool ok = false;
  double interval = 0.0;
  double jitter = 0.0;
};
StampFit smooth_stamps(std::span<const double> t, std::span<double> smooth,
                       std::span<double> scratch);

}  // namespace shaker::daemon
