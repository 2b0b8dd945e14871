// Draws that are the same on every machine and with every standard library.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace shaker::dirty {

// SplitMix64 (Steele, Lea, Flood 2014): 64 bits of state, one draw a step.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31U);
  }
  // In [low, high).
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(bits() >> 11U) * 0x1p-53;
  }
  // In [low, high), uniform in the logarithm.
  double log_uniform(double low, double high) {
    return std::exp(uniform(std::log(low), std::log(high)));
  }
  // One of 0 .. count - 1.
  int below(int count) { return static_cast<int>(uniform(0.0, count)); }
  double sign() { return uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0; }
  // Standard normal (Box and Muller).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(0.0, 1.0)));
    return radius * std::cos(2.0 * std::numbers::pi * uniform(0.0, 1.0));
  }

 private:
  std::uint64_t state_;
};

// First-order autoregressive noise of standard deviation 1 and this correlation time, s.
class ColouredNoise {
 public:
  ColouredNoise(Random& random, double step, double time)
      : random_(random), keep_(std::exp(-step / time)), value_(random.normal()) {}
  double next() {
    value_ = keep_ * value_ + std::sqrt(1.0 - keep_ * keep_) * random_.normal();
    return value_;
  }

 private:
  Random& random_;
  double keep_;
  double value_;
};

}  // namespace shaker::dirty
