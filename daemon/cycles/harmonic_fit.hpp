// Fits a Fourier series to one block of samples at a given frequency, by least squares.
//
// The samples are unevenly spaced: with a jitter of 10 % and lost samples a DFT leaks, a fit
// does not. A second pass omits outliers (beyond eight robust standard deviations), so that a
// single wrong sample does not change the phase.
#pragma once

#include <array>
#include <complex>
#include <span>
#include <vector>

namespace shaker::daemon {

inline constexpr int kExcitationHarmonics = 5;  // fundamental included

// v(t) ~ mean + sum_h Re(c[h-1] exp(2 pi i h f t)).
struct HarmonicFit {
  bool ok = false;
  double mean = 0.0;
  std::array<std::complex<double>, kExcitationHarmonics> c{};
  double noise = 0.0;  // standard deviation of the residual
  long used = 0;       // samples without the outliers

  double amplitude() const { return std::abs(c[0]); }
  // Phase of the fundamental at t = 0, in turns in (-0.5, 0.5]; 0 at its positive peak.
  double turns() const;
  // Value of the series without its mean, `turns` after the fundamental's positive peak.
  double periodic_part(double turns) const;
};

// One thread; allocates only for more than `samples_max` samples. `t` in s. ok is false for
// fewer than 2 samples per unknown or a singular fit.
class HarmonicFitter {
 public:
  explicit HarmonicFitter(std::size_t samples_max) { scratch_.reserve(2 * samples_max); }
  HarmonicFit fit(std::span<const double> t, std::span<const double> v, double frequency_hz);

 private:
  std::vector<double> scratch_;
};

}  // namespace shaker::daemon
