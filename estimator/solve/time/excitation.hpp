// The table's acceleration as a function of time, for records that are not periodic. "m" in the
// units of this folder stands for the model's length unit.
#pragma once

#include <span>
#include <vector>

namespace shaker::estimator {

// The sum of a constant and either measured samples (interpolated by the cubic through the four
// nearest) or a cosine. value() is const and may be called from any thread.
class Excitation {
 public:
  Excitation() = default;  // zero: free decay, drop
  static Excitation constant(double acceleration);
  // amplitude * cos(2 pi frequency t + phase)
  static Excitation cosine(double amplitude, double frequency_hz, double phase = 0.0);
  // Samples `x` (m/s^2) at times `t` (s). Throws std::invalid_argument unless there are at least
  // two samples, both spans have one size, t increases and all values are finite.
  static Excitation sampled(std::span<const double> t, std::span<const double> x);

  // The acceleration at time t, m/s^2. Outside the samples it is that of the nearest sample.
  double value(double t) const;
  bool sampled() const { return !t_.empty(); }
  Excitation& add_constant(double acceleration);

 private:
  double interpolated(double t) const;

  double constant_ = 0.0;
  double amplitude_ = 0.0, circular_ = 0.0, phase_ = 0.0;
  std::vector<double> t_, x_;
  double rate_ = 0.0;  // samples per second if they are equidistant, else 0
};

}  // namespace shaker::estimator
