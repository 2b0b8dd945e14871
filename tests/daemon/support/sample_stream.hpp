// Samples of a periodic motion as a rig delivers them: with its own clock, jitter, losses and
// noise.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "base/clock.hpp"

namespace shaker::testing {

struct StreamOptions {
  double frequency_hz = 2.0;  // commanded, on the rig's clock
  double rate_hz = 1000.0;
  double clock_ppm = 0.0;     // the rig's clock is faster by this
  double phase_turns = 0.0;   // of the excitation at t = 0
  double jitter = 0.0;        // uniform, +- this many samples
  bool stamps_wander = true;  // only the stamp is wrong; false: the sampling instant is
  double drift_s = 0.0;       // amplitude of a slow error of all stamps, period 6 s
  double dropout = 0.0;
  double noise_m = 0.0, noise_m_s2 = 0.0;
  unsigned seed = 1;
};

class SampleStream {
 public:
  using Signal = std::function<double(double tau)>;
  SampleStream(StreamOptions options, Signal stroke, Signal excitation)
      : o_(options),
        stroke_(std::move(stroke)),
        excitation_(std::move(excitation)),
        random_(options.seed) {}

  double true_frequency() const { return o_.frequency_hz * (1.0 + 1e-6 * o_.clock_ppm); }
  double tau(double t) const { return o_.phase_turns + true_frequency() * t; }

  // Calls take(t, stroke, excitation) for every sample that is not lost, until the host's clock
  // shows `end`, s.
  template <class Take>
  void run_to(double end, Take take) {
    const double interval = 1.0 / (o_.rate_hz * (1.0 + 1e-6 * o_.clock_ppm));
    for (; (static_cast<double>(k_) + 1.0) * interval < end; ++k_) {
      const double clock = static_cast<double>(k_) * interval;
      const double wander = o_.jitter * interval * uniform_(random_);
      const double taken = o_.stamps_wander ? clock : clock + wander;
      const double u = stroke_(tau(taken)) + o_.noise_m * normal_(random_);
      const double x = excitation_(tau(taken)) + o_.noise_m_s2 * normal_(random_);
      if (0.5 * (uniform_(random_) + 1.0) < o_.dropout) continue;
      const double drift = o_.drift_s * std::sin(2.0 * std::numbers::pi * clock / 6.0);
      take(from_seconds(clock + drift + wander), u, x);
    }
  }

 private:
  StreamOptions o_;
  Signal stroke_, excitation_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_{-1.0, 1.0};
  std::normal_distribution<double> normal_;
  long k_ = 1;
};

}  // namespace shaker::testing
