// Records of a mass that is let go, by Runge and Kutta's steps of a force per unit mass.
#pragma once

#include <functional>
#include <random>

#include "estimator/diagnosis/campaign.hpp"

namespace shaker::estimator::diagnosis::testing {

struct Decay {
  double start = 0.1, duration = 10.0, rate = 200.0, noise = 2e-5;
  std::uint64_t seed = 1;
};

// u'' = -force(u, v), from rest at `start`; no excitation.
inline Recording decay_of(const std::function<double(double, double)>& force, const Decay& decay) {
  constexpr int kSteps = 20;  // between two samples
  std::mt19937_64 source(decay.seed);
  std::normal_distribution<double> noise(0.0, decay.noise);
  Recording r;
  r.name = "decay";
  r.kind = Kind::transient;
  r.role_given = true;
  const double h = 1.0 / (decay.rate * kSteps);
  double u = decay.start, v = 0.0;
  for (int i = 0; i < static_cast<int>(decay.duration * decay.rate); ++i) {
    r.t.push_back(i / decay.rate);
    r.displacement.push_back(u + noise(source));
    for (int k = 0; k < kSteps; ++k) {
      const double a1 = -force(u, v);
      const double u2 = u + 0.5 * h * v, v2 = v + 0.5 * h * a1, a2 = -force(u2, v2);
      const double u3 = u + 0.5 * h * v2, v3 = v + 0.5 * h * a2, a3 = -force(u3, v3);
      const double u4 = u + h * v3, v4 = v + h * a3, a4 = -force(u4, v4);
      u += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
      v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
  }
  return r;
}

}  // namespace shaker::estimator::diagnosis::testing
