// How much one accepted cycle differs from the next: the noise that the estimates really have.
//
// The sensor's own noise falls out of every cycle (Resampled::point_noise); what is above it from
// cycle to cycle is the rig's repeatability. Running mean and scatter of the points, and of the
// first harmonics as complex numbers, so that a wandering phase (scatter across the harmonic) can
// be told from a wandering amplitude (along it). Welford's update: no history is kept. One thread;
// add() does not allocate.
#pragma once

#include <array>
#include <complex>
#include <span>
#include <vector>

namespace shaker::daemon {

inline constexpr std::size_t kStrokeHarmonics = 5;  // mean and harmonics 1 to 4

// c[0] is the mean; u(tau) ~ c0 + sum Re(c_h exp(2 pi i h tau)).
std::array<std::complex<double>, kStrokeHarmonics> stroke_harmonics(std::span<const double> cycle);

class CycleNoise {
 public:
  struct Covariance {
    double along = 0.0, across = 0.0,
           mixed = 0.0;  // m^2, relative to the mean harmonic's direction
  };
  // Of the mean, then of each harmonic along and across its own mean direction.
  static constexpr std::size_t kCoefficients = 2 * kStrokeHarmonics - 1;
  using Matrix = std::array<std::array<double, kCoefficients>, kCoefficients>;

  void restart(std::size_t points);
  void add(std::span<const double> cycle);

  long cycles() const { return count_; }
  // Of one point from cycle to cycle, m; 0 with fewer than two cycles.
  double point_standard_deviation() const;
  Covariance covariance(std::size_t harmonic) const;  // precondition: harmonic < kStrokeHarmonics
  // All of them together, m^2: what wanders in one harmonic wanders in the others too. 0 with fewer
  // than two cycles.
  Matrix covariance() const;

 private:
  long count_ = 0;
  std::vector<double> mean_;
  double squares_ = 0.0;
  std::array<std::complex<double>, kStrokeHarmonics> harmonic_mean_{};
  Matrix products_{};  // of the deviations: mean, then real and imaginary parts
};

}  // namespace shaker::daemon
