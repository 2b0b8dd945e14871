// Records of a mass that is let go, by Runge and Kutta's steps of a force per unit mass.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "estimator/diagnosis/campaign.hpp"

namespace shaker::estimator::diagnosis::testing {

struct Decay {
  double start = 0.1, duration = 10.0, rate = 200.0, noise = 2e-5;
  std::uint64_t seed = 1;
};

struct Moving {
  double u, v;
};

// A step of Runge and Kutta; `a`: the acceleration at u and v.
template <class Acceleration>
Moving stepped(const Acceleration& a, Moving s, double h) {
  const double a1 = a(s.u, s.v), v2 = s.v + 0.5 * h * a1, a2 = a(s.u + 0.5 * h * s.v, v2);
  const double v3 = s.v + 0.5 * h * a2, a3 = a(s.u + 0.5 * h * v2, v3);
  const double v4 = s.v + h * a3, a4 = a(s.u + h * v3, v4);
  return {s.u + h / 6.0 * (s.v + 2.0 * v2 + 2.0 * v3 + v4),
          s.v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)};
}

inline Recording empty_record() {
  Recording r;
  r.name = "decay";
  r.kind = Kind::transient;
  r.role_given = true;
  return r;
}

// u'' = -force(u, v), from rest at `start`; no excitation.
inline Recording decay_of(const std::function<double(double, double)>& force, const Decay& decay) {
  constexpr int kSteps = 20;  // between two samples
  std::mt19937_64 source(decay.seed);
  std::normal_distribution<double> noise(0.0, decay.noise);
  Recording r = empty_record();
  const double h = 1.0 / (decay.rate * kSteps);
  const auto a = [&](double u, double v) { return -force(u, v); };
  Moving now{decay.start, 0.0};
  for (int i = 0; i < static_cast<int>(decay.duration * decay.rate); ++i) {
    r.t.push_back(i / decay.rate);
    r.displacement.push_back(now.u + noise(source));
    for (int k = 0; k < kSteps; ++k)
      now = stepped(a, now, h);
  }
  return r;
}

// u'' = -force(u, v) - friction sign(v), which sticks where the force is less than the friction. A step
// in which the velocity reverses ends at the reversal, by halving.
inline Recording sticking_decay_of(const std::function<double(double, double)>& force,
                                   double friction, const Decay& decay) {
  constexpr int kSteps = 20;  // between two samples
  std::mt19937_64 source(decay.seed);
  std::normal_distribution<double> noise(0.0, decay.noise);
  Recording r = empty_record();
  Moving now{decay.start, 0.0};
  const auto step = [&](Moving s, double h, double way) {
    return stepped([&](double u, double v) { return -force(u, v) - way * friction; }, s, h);
  };
  const double whole = 1.0 / (decay.rate * kSteps);
  for (int i = 0; i < static_cast<int>(decay.duration * decay.rate); ++i) {
    r.t.push_back(i / decay.rate);
    r.displacement.push_back(now.u + noise(source));
    for (double left = kSteps * whole; left > 1e-3 * whole;) {
      const double pull = -force(now.u, 0.0);
      if (now.v == 0.0 && std::fabs(pull) <= friction) break;
      const double way = (now.v != 0.0 ? now.v : pull) > 0.0 ? 1.0 : -1.0;
      double h = std::min(whole, left);
      Moving next = step(now, h, way);
      if (way * next.v < 0.0) {
        double low = 0.0;
        for (int half = 0; half < 50; ++half) {
          const double middle = 0.5 * (low + h);
          (way * step(now, middle, way).v < 0.0 ? h : low) = middle;
        }
        next = {step(now, h, way).u, 0.0};
      }
      now = next;
      left -= h;
    }
  }
  return r;
}

}  // namespace shaker::estimator::diagnosis::testing
