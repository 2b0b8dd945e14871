#include "tests/dirty/device.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace shaker::dirty {

// The polytrope of the gas at a stroke. Past 0.99 / theta3 its slope continues straight: the gas is
// never crushed to nothing.
double Device::pressure(double u, const RunChange& run) const {
  const double softened = u - n_.second_share * std::max(u - n_.second_u, 0.0);
  const double left = std::max(1.0 - n_.theta3 * softened, 0.01);
  return n_.theta2 * (1.0 + run.temperature) * std::pow(left, -n_.theta4);
}

double Device::gas(const State& s, const RunChange& run, State& rate) const {
  const double u = s[kStroke];
  double p = pressure(u, run);
  if (n_.heat_tau > 0.0) {
    const double left = std::max(1.0 - n_.theta3 * u, 0.01);
    p = n_.theta2 * (1.0 + run.temperature) * s[kHeat] / left;
    rate[kHeat] = (1.0 - s[kHeat]) / n_.heat_tau + 0.4 * s[kHeat] * n_.theta3 * s[kVelocity] / left;
  }
  const double over = p / n_.theta2 - 1.0;
  double force = p + n_.real * p * over;
  if (n_.solution_tau > 0.0) {
    const double m = s[kDissolved];
    rate[kDissolved] = (1.0 - n_.solubility * (m * (over + 1.0) - 1.0) - m) / n_.solution_tau;
    force += (m - 1.0) * p;
  }
  return force;
}

// Of oil that flows at `v` where the piston is at `u`.
double Device::orifice(double u, double v, double scale) const {
  const double xi = u / 0.2;  // of the stroke, 0.2 m
  const double left = std::max(1.0 - n_.pin1 * xi - n_.pin2 * xi * xi, 0.05);
  const double speed =
      n_.laminar_v > 0.0
          ? std::sqrt(0.5 * (v * v + std::hypot(v * v, 2.0 * n_.laminar_v * n_.laminar_v)))
          : std::abs(v);
  double f = n_.theta1 * scale * v * speed / (left * left);
  if (v < 0.0) return std::max(f * n_.rebound, -n_.cavitation_f);
  return f - (1.0 - n_.relief_k) * std::max(f - n_.relief_f, 0.0);
}

double Device::oil(const State& s, double scale, State& rate) const {
  if (n_.oil_k == 0.0) return orifice(s[kStroke], s[kVelocity], scale);
  // theta1 (|q| + leak) q = k d, solved for the flow q.
  const double f = n_.oil_k * s[kOil] / (n_.theta1 * scale);
  const double half = 0.5 * n_.oil_leak;
  const double flow = std::copysign(std::sqrt(half * half + std::abs(f)) - half, f);
  rate[kOil] = s[kVelocity] - flow;
  return n_.oil_k * s[kOil];
}

double Device::linear(const State& s, const RunChange& run, State& rate) const {
  const double c = n_.c * (1.0 + run.temperature);
  if (n_.play_k == 0.0) return c * s[kVelocity] + n_.k * s[kStroke];
  const double gap = s[kStroke] - s[kInner];
  const double pressed = std::max(gap - 0.5 * n_.play, 0.0) - std::max(-gap - 0.5 * n_.play, 0.0);
  const double f = n_.play_k * pressed;
  rate[kInner] = (f - n_.k * s[kInner]) / c;
  return f;
}

double Device::beside(const State& s, State& rate) const {
  const double u = s[kStroke], v = s[kVelocity], off = u - n_.cubic_u0;
  double f = n_.viscous * v + n_.spring_k * (u - n_.spring_u0) + n_.cubic_k * off * off * off +
             n_.drag * std::abs(v) * v;
  if (u > n_.stop_u) f += n_.stop_k * (u - n_.stop_u) + n_.stop_d * v;
  if (n_.lag > 0.0) rate[kLagged] = (u - s[kLagged]) / n_.lag;
  return f;
}

double Device::memory(const State& s, State& rate) const {
  const double v = s[kVelocity];
  double f = 0.0;
  if (n_.dahl_f > 0.0) {
    rate[kDahl] = v - std::abs(v) * s[kDahl] / n_.dahl_z0;
    f += n_.dahl_f * s[kDahl] / n_.dahl_z0;
  }
  if (n_.wen_k > 0.0) {
    const double z = s[kBoucWen];
    const double power = std::pow(std::abs(z), n_.wen_n);
    rate[kBoucWen] = v - n_.wen_b * std::abs(v) * std::copysign(power, z) - n_.wen_c * v * power;
    f += n_.wen_k * z;
  }
  return f;
}

double Device::unknown(const State& s, State& rate) const {
  const double u = s[kStroke];
  double f = n_.cogging * std::sin(2.0 * std::numbers::pi * (u - n_.cogging_u) / n_.cogging_length);
  rate[kBush] = (u - s[kBush]) / n_.bush_tau;
  f += n_.bush * (u - s[kBush]);
  if (n_.appendage > 0.0) {
    const double pull = n_.appendage_omega * n_.appendage_omega * (u - s[kAppendage]) +
                        n_.appendage_damping * (s[kVelocity] - s[kAppendageRate]);
    rate[kAppendage] = s[kAppendageRate];
    rate[kAppendageRate] = pull;
    f += n_.appendage * pull;
  }
  return f;
}

double Device::force(const State& s, const RunChange& run, State& rate) const {
  rate.fill(0.0);
  const double scale = 1.0 / (1.0 + s[kWarmth]);
  double f = beside(s, rate) + memory(s, rate) + unknown(s, rate) + run.preload;
  double damping = 0.0;
  if (oleo_) {
    damping = oil(s, scale, rate);
    f += damping + gas(s, run, rate);
  } else {
    damping = n_.c * s[kVelocity] * scale;
    f += linear(s, run, rate) + damping - n_.c * s[kVelocity];
  }
  if (weight_) f -= kGravity;
  rate[kWarmth] = n_.fading * damping * s[kVelocity] - s[kWarmth] / n_.fading_tau;
  return f;
}

DryFriction Device::dry(const State& s, const RunChange& run) const {
  double slipping = n_.coulomb + n_.peak_f + n_.tilt * std::abs(s[kStroke] - n_.tilt_u);
  if (n_.pressed > 0.0) slipping += n_.pressed * pressure(s[kStroke], run);
  const double peak = n_.peak_f * (n_.peak_ratio - 1.0);
  const double over = s[kVelocity] / n_.peak_v;
  return {.slipping = slipping + peak * std::exp(-over * over), .holding = slipping + peak};
}

double Device::mobility() const {
  return n_.tyre_r > 0.0 ? 1.0 + 1.0 / n_.tyre_r : 1.0 / (1.0 + n_.added_mass);
}

double Device::acceleration(const State& s, double excitation, double dry, const RunChange& run,
                            State& rate) const {
  const double f = force(s, run, rate) + dry;
  double a = (excitation - f) / (1.0 + n_.added_mass);
  if (n_.tyre_r > 0.0) {
    // `f` is less the weight of the sprung mass; the tyre carries both masses.
    const double load = n_.tyre_k * s[kTyre] + n_.tyre_c * s[kTyreRate];
    const double weight = weight_ ? kGravity : 0.0;
    const double tyre = excitation + weight - (load - f - weight) / n_.tyre_r;
    rate[kTyre] = s[kTyreRate];
    rate[kTyreRate] = tyre;
    a = excitation - f - tyre;
  }
  rate[kStroke] = s[kVelocity];
  rate[kVelocity] = a;
  return a;
}

double Device::shown(const State& s, double load, double t, const RunChange& run) const {
  double u = n_.lag > 0.0 ? s[kLagged] : s[kStroke];
  if (n_.joint_k > 0.0) u += load / n_.joint_k;
  const double xi = u / 0.1;
  u += 0.1 * (n_.bend2 * xi * xi + n_.bend3 * xi * xi * xi);
  return n_.gain * u + n_.drift * t + run.zero;
}

bool Device::has_dry_friction() const {
  return n_.coulomb > 0.0 || n_.pressed > 0.0 || n_.peak_f > 0.0 || n_.tilt > 0.0;
}

State Device::at_rest(double stroke) const {
  State s{};
  s[kStroke] = s[kInner] = s[kLagged] = s[kBush] = s[kAppendage] = stroke;
  s[kHeat] = s[kDissolved] = 1.0;
  const double over = oleo_ ? pressure(stroke, {}) / n_.theta2 : 1.0;
  if (n_.solution_tau > 0.0) s[kDissolved] = (1.0 + n_.solubility) / (1.0 + n_.solubility * over);
  if (n_.tyre_r > 0.0 && weight_) s[kTyre] = (1.0 + n_.tyre_r) * kGravity / n_.tyre_k;
  return s;
}

double Device::rest() const {
  if (!oleo_ || !weight_) return 0.0;
  double low = 0.0, high = 0.98 / n_.theta3;
  State rate;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (force(at_rest(middle), {}, rate) < 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace shaker::dirty
