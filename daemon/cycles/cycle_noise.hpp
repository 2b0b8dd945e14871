// Cycle-to-cycle noise of the accepted cycles: the actual noise of the estimates.
//
// The noise of the sensor comes from within a cycle (Resampled::point_noise); the additional
// noise from cycle to cycle is the repeatability of the rig. The class computes running mean
// and scatter of the points, and of the mean and the first four harmonics as complex numbers.
// Scatter across a harmonic is a wandering phase, scatter along it a wandering amplitude.
// Welford's update needs no history. One thread; add() does not allocate.
#pragma once

#include <array>
#include <complex>
#include <span>
#include <string>
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
  // Order: the mean, then for each harmonic the parts along and across its own mean direction.
  static constexpr std::size_t kCoefficients = 2 * kStrokeHarmonics - 1;
  using Matrix = std::array<std::array<double, kCoefficients>, kCoefficients>;

  void restart(std::size_t points);
  void add(std::span<const double> cycle);

  long cycles() const { return count_; }
  // Standard deviation of one point from cycle to cycle, m; 0 with fewer than two cycles.
  double point_standard_deviation() const;
  Covariance covariance(std::size_t harmonic) const;  // precondition: harmonic < kStrokeHarmonics
  // Covariance of all coefficients, m^2, with the correlation between harmonics; 0 with fewer
  // than two cycles.
  Matrix covariance() const;

 private:
  long count_ = 0;
  std::vector<double> mean_;
  double squares_ = 0.0;
  std::array<std::complex<double>, kStrokeHarmonics> harmonic_mean_{};
  Matrix products_{};  // of the deviations: mean, then real and imaginary parts
};

// For people: how well the cycles repeat. `sensor` is the noise of one point in a cycle, m.
std::string repeatability(const CycleNoise& noise, double sensor);

}  // namespace shaker::daemon
