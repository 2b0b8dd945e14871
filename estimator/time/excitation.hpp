// The table's acceleration as a function of time, for records that are not periodic.
#pragma once

#include <span>
#include <vector>

namespace shaker::estimator {

// A value: what was measured (samples, between which a cubic runs through the four nearest), or a
// cosine, plus a constant. Immutable once made; value() may be called from any thread.
class Excitation {
 public:
  Excitation() = default;  // none: free decay, drop
  static Excitation constant(double acceleration);
  // amplitude * cos(2 pi frequency t + phase)
  static Excitation cosine(double amplitude, double frequency_hz, double phase = 0.0);
  // Throws std::invalid_argument unless t increases, both have one size and all is finite.
  static Excitation sampled(std::span<const double> t, std::span<const double> x);

  // Outside of the samples the nearest one holds.
  double value(double t) const;
  bool sampled() const { return !t_.empty(); }
  Excitation& add_constant(double acceleration);

 private:
  double interpolated(double t) const;

  double constant_ = 0.0;
  double amplitude_ = 0.0, circular_ = 0.0, phase_ = 0.0;
  std::vector<double> t_, x_;
  double rate_ = 0.0;  // samples a second when they are even, else 0
};

}  // namespace shaker::estimator
