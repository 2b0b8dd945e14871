#include "tests/estimator/model/effects/formulas.hpp"

#include <cmath>

namespace shaker::estimator::testing {
namespace {

C magnitude(C x) {
  return x.real() < 0 ? -x : x;
}
C smooth(C x, double e) {
  return std::sqrt(x * x + e * e);
}
C gas(C u, C theta2, C theta3, C theta4) {
  return theta2 * std::pow(1.0 / (1.0 - theta3 * u), theta4);
}

C ramp(C x, double w) {
  return w * std::log(1.0 + std::exp(x / w));
}
C orifice(C theta1, C v) {
  return theta1 * magnitude(v) * v;
}
const double kPi = std::acos(-1.0);

// ln(A_1 / A) over that of all knots of a table with five knots 0.05 m apart, as the catalogue's:
// the integral of slopes that follow one another by exp(r), through which goes the monotone cubic of
// Fritsch and Butland; a line beyond. Divided differences.
C pin_shape(C u, const std::vector<C>& r) {
  constexpr double h = 0.05;
  std::vector<C> slope, value = {0.0};
  C grown = 1.0;
  for (const C& step : r)
    slope.push_back(grown *= std::exp(step));
  for (const C& one : slope)
    value.push_back(value.back() + h * one);
  for (C& one : slope)
    one /= value.back();
  const C all = value.back();
  for (C& one : value)
    one /= all;
  std::vector<C> at = {slope.front()};
  for (std::size_t i = 1; i < slope.size(); ++i)
    at.push_back(2.0 / (1.0 / slope[i - 1] + 1.0 / slope[i]));
  at.push_back(slope.back());
  if (u.real() <= 0.0) return at.front() * u;
  if (u.real() >= 4.0 * h) return 1.0 + at.back() * (u - 4.0 * h);
  const auto i = static_cast<std::size_t>(u.real() / h);
  const C left = u - h * static_cast<double>(i), right = left - h;
  const C bend = (slope[i] - at[i]) / h, twist = (at[i] + at[i + 1] - 2.0 * slope[i]) / (h * h);
  return value[i] + left * (at[i] + left * (bend + right * twist));
}

using E = std::vector<C>;
using Formulas = std::map<std::string, Formula>;

Formulas springs_and_inertias() {
  return {
      {"gravity", {[](const Seen& s) { return E{-s.c[0]}; }, {}, {9.8}}},
      {"linear_stiffness",
       {[](const Seen& s) { return E{s.t[0] * (s.u - s.c[0])}; }, {7.5}, {0.03}}},
      {"quadratic_stiffness",
       {[](const Seen& s) { return E{s.t[0] * (s.u - s.c[0]) * (s.u - s.c[0])}; }, {0.6}, {0.01}}},
      {"cubic_stiffness",
       {[](const Seen& s) { return E{s.t[0] * std::pow(s.u - s.c[0], 3)}; }, {0.8}, {-0.02}}},
      {"quintic_stiffness",
       {[](const Seen& s) { return E{s.t[0] * std::pow(s.u - s.c[0], 5)}; }, {0.9}, {0.015}}},
      {"end_stop",
       {[](const Seen& s) {
          const C depth = s.u - s.t[2];
          return E{s.t[0] * ramp(depth, s.c[0]) + s.t[1] * s.v / (1.0 + std::exp(-depth / s.c[0]))};
        },
        {300.0, 4.0, 0.09},
        {0.01}}},
      {"free_play",
       {[](const Seen& s) {
          return E{s.t[1] * (ramp(s.u - s.t[0] / 2.0, s.c[0]) - ramp(-s.u - s.t[0] / 2.0, s.c[0]))};
        },
        {0.04, 800.0},
        {0.01}}},
      {"added_mass", {[](const Seen& s) { return E{s.t[0] * s.a}; }, {0.03}, {}}},
      {"tyre",
       {[](const Seen& s) {
          const C y = s.w[0], r = s.t[0], x = s.c[1] * s.x;
          // Sprung mass: u'' + y'' + F - g = x; unsprung: r y'' - F + k y + c y' - r g = r x.
          const C F = x + s.c[0] - s.a - s.w_ddot[0];
          return E{s.w_ddot[0],
                   r * s.w_ddot[0] - F + s.t[1] * y + s.t[2] * s.w_dot[0] - r * s.c[0] - r * x};
        },
        {0.12, 900.0, 3.0},
        {9.81, 0.7}}},
  };
}

Formulas frictions() {
  return {
      {"viscous_damping", {[](const Seen& s) { return E{s.t[0] * s.v}; }, {0.25}, {}}},
      {"pressure_friction",
       {[](const Seen& s) {
          return E{s.t[0] * gas(s.u, s.t[1], s.t[2], s.t[3]) * std::tanh(s.v / s.c[0])};
        },
        {0.04, 1.524, 5.31496, 1.2},
        {0.05}}},
      {"presliding_friction",
       {[](const Seen& s) {
          return E{s.t[0] * s.w[0], s.t[1] * s.w_dot[0] - s.v + smooth(s.v, s.c[0]) * s.w[0]};
        },
        {0.4, 2e-3},
        {0.004}}},
      {"coulomb_friction",
       {[](const Seen& s) { return E{s.t[0] * std::tanh(s.v / s.c[0])}; }, {0.4}, {0.04}}},
      {"stribeck_friction",
       {[](const Seen& s) {
          const C level = s.t[0] + s.t[0] * (s.t[1] - 1.0) * std::exp(-std::pow(s.v / s.t[2], 2));
          return E{level * std::tanh(s.v / s.c[0])};
        },
        {0.4, 1.4, 0.09},
        {0.04}}},
      {"pinched_friction",
       {[](const Seen& s) {
          const C near = std::exp(-std::pow((s.u - s.t[1]) / s.t[2], 2));
          return E{(s.t[0] - s.t[0] * near) * std::tanh(s.v / s.c[0])};
        },
        {0.4, 0.02, 0.05},
        {0.04}}},
      {"bouc_wen_hysteresis",
       {[](const Seen& s) {
          const C size = smooth(s.w[0], s.c[1]), n = s.t[3];
          return E{
              s.t[0] * s.w[0],
              s.t[1] * s.w_dot[0] - (s.v - smooth(s.v, s.c[0]) * std::pow(size, n - 1.0) * s.w[0] -
                                     s.t[2] * s.v * std::pow(size, n))};
        },
        {0.7, 0.004, 0.65, 1.6},
        {0.01, 0.05}}},
  };
}

Formulas orifices() {
  return {
      {"orifice_damping",
       {[](const Seen& s) { return E{s.t[0] * magnitude(s.v) * s.v}; }, {16.6667}, {}}},
      {"laminar_orifice",
       {[](const Seen& s) {
          const C v2 = s.v * s.v, vc = s.t[0];
          const C speed = std::sqrt((v2 + std::sqrt(v2 * v2 + 4.0 * vc * vc * vc * vc)) / 2.0);
          return E{s.t[1] * s.v * speed - orifice(s.t[1], s.v)};
        },
        {0.05, 16.7},
        {}}},
      {"rebound_damping",
       {[](const Seen& s) {
          return E{s.v.real() < 0.0 ? (s.t[0] - 1.0) * orifice(s.t[1], s.v) : C(0.0)};
        },
        {2.5, 16.7},
        {}}},
      {"metering_pin",
       {[](const Seen& s) {
          const C xi = s.u / s.c[0];
          return E{orifice(s.t[2], s.v) *
                   (std::pow(1.0 - s.t[0] * xi - s.t[1] * xi * xi, -2.0) - 1.0)};
        },
        {0.2, 0.3, 16.7},
        {0.2}}},
      {"tabulated_pin",
       {[](const Seen& s) {
          const C closed = std::exp(s.t[0] * pin_shape(s.u, {0.0, s.t[1], s.t[2], s.t[3]}));
          return E{orifice(s.t[4], s.v) * (closed * closed - 1.0)};
        },
        {0.8, 0.3, -0.5, 0.9, 16.7},
        {}}},
      {"relief_valve",
       {[](const Seen& s) {
          return E{-(1.0 - s.t[1]) * ramp(orifice(s.t[2], s.v) - s.t[0], s.c[0])};
        },
        {2.0, 0.25, 16.7},
        {0.5}}},
      {"cavitation",
       {[](const Seen& s) {
          const C excess = -orifice(s.t[1], s.v) * s.t[2] - s.t[0];
          return E{s.v.real() < 0.0 ? ramp(excess, s.c[0]) - ramp(-s.t[0], s.c[0]) : C(0.0)};
        },
        {1.5, 16.7, 1.3},
        {0.4}}},
  };
}

Formulas dampings() {
  return {
      {"one_sided_damping",
       {[](const Seen& s) { return E{0.5 * s.t[0] * (s.v + smooth(s.v, s.c[0]))}; },
        {-0.7},
        {0.02}}},
      {"stroke_damping",
       {[](const Seen& s) { return E{s.t[0] * (s.u - s.c[0]) * s.v}; }, {-3.0}, {0.07}}},
      {"digressive_damping",
       {[](const Seen& s) { return E{s.t[0] * s.v / std::sqrt(1.0 + std::pow(s.v / s.t[1], 2))}; },
        {1.3, 0.08},
        {}}},
      {"power_damping",
       {[](const Seen& s) {
          return E{s.t[0] * s.v * std::pow(smooth(s.v, s.c[0]) / s.c[1], s.t[1] - 1.0)};
        },
        {1.3, 0.35},
        {0.02, 0.4}}},
  };
}

Formulas gas_and_oil() {
  return {
      {"gas_spring",
       {[](const Seen& s) { return E{gas(s.u, s.t[0], s.t[1], s.t[2])}; },
        {1.524, 5.31496, 1.2},
        {}}},
      {"oil_compressibility",
       {[](const Seen& s) {
          const C flow = s.v - s.w_dot[0];
          return E{s.t[0] * s.w[0] - orifice(s.t[2], s.v),
                   s.t[0] * s.w[0] - orifice(s.t[2], flow) - s.t[2] * s.t[1] * flow};
        },
        {2e3, 0.02, 16.7},
        {}}},
      {"gas_heat_transfer",
       {[](const Seen& s) {
          const C column = 1.0 - s.t[2] * s.u, T = s.w[0];
          return E{s.t[1] * T / column - gas(s.u, s.t[1], s.t[2], s.t[3]),
                   s.w_dot[0] - (1.0 - T) / s.t[0] - (s.c[0] - 1.0) * T * s.t[2] * s.v / column};
        },
        {0.3, 1.524, 5.31496, 1.2},
        {1.4}}},
      {"dissolved_gas",
       {[](const Seen& s) {
          const C pressure = gas(s.u, s.t[2], s.t[3], s.t[4]), m = s.w[0];
          return E{m * pressure - pressure,
                   s.t[1] * s.w_dot[0] - (1.0 - s.t[0] * (m * pressure / s.t[2] - 1.0) - m)};
        },
        {0.07, 0.8, 1.524, 5.31496, 1.2},
        {}}},
      {"real_gas",
       {[](const Seen& s) {
          const C pressure = gas(s.u, s.t[1], s.t[2], s.t[3]);
          return E{s.t[0] * (pressure * pressure / s.t[1] - pressure)};
        },
        {0.02, 1.524, 5.31496, 1.2},
        {}}},
      {"second_chamber",
       {[](const Seen& s) {
          const C eased = s.u - s.t[0] * ramp(s.u - s.t[1], s.c[0]);
          return E{gas(eased, s.t[2], s.t[3], s.t[4]) - gas(s.u, s.t[2], s.t[3], s.t[4])};
        },
        {0.35, 0.08, 1.524, 5.31496, 1.2},
        {0.01}}},
  };
}

Formulas exciters() {
  return {
      {"exciter_phase",
       {[](const Seen& s) {
          return E{s.x - (s.x * std::cos(s.t[0]) + s.x_quadrature * std::sin(s.t[0]))};
        },
        {0.07},
        {}}},
      {"exciter_delay",
       {[](const Seen& s) {
          const C carrier(s.carrier_cos, s.carrier_sin);
          C ahead = 0.0;
          double now = 0.0;
          for (std::size_t h = 1; h <= 5; ++h) {
            const double p = s.harmonics[2 * h - 2], q = s.harmonics[2 * h - 1];
            const C power = std::pow(carrier, static_cast<double>(h));
            const double c = power.real(), d = power.imag();
            const C turn = static_cast<double>(h) * s.carrier_omega * s.t[0];
            now += p * c + q * d;
            ahead += p * (c * std::cos(turn) - d * std::sin(turn)) +
                     q * (d * std::cos(turn) + c * std::sin(turn));
          }
          return E{now - ahead};
        },
        {0.004},
        {}}},
      {"exciter_distortion",
       {[](const Seen& s) {
          const C carrier(s.carrier_cos, s.carrier_sin);
          C sum = 0.0;
          for (int h = 2; h <= 5; ++h) {
            const C power = std::pow(carrier, h);
            sum += s.t[2 * (h - 2)] * power.real() + s.t[2 * (h - 2) + 1] * power.imag();
          }
          return E{-s.carrier_amplitude * sum};
        },
        {0.01, 0.02, -0.03, 0.04, 0.05, -0.06, 0.07, 0.08},
        {}}},
      {"exciter_gain", {[](const Seen& s) { return E{-(s.t[0] - 1.0) * s.x}; }, {1.04}, {}}},
  };
}

}  // namespace

const std::map<std::string, Formula>& formulas() {
  static const Formulas all = [] {
    Formulas joined = springs_and_inertias();
    for (Formulas part : {frictions(), orifices(), dampings(), gas_and_oil(), exciters()})
      joined.merge(part);
    return joined;
  }();
  return all;
}

const std::map<std::string, Sensing>& sensings() {
  using T = std::vector<double>;
  static const std::map<std::string, Sensing> all = {
      {"sensor_gain", {[](const SeenSignal& s) { return s.theta[0] * s.y; }, {}, {1.03}, {}}},
      {"sensor_offset", {[](const SeenSignal& s) { return s.y + s.theta[0]; }, {}, {0.003}, {}}},
      {"sensor_drift",
       {[](const SeenSignal& s) { return s.y + s.theta[0] * s.t; }, {}, {0.002}, {}}},
      {"sensor_nonlinearity",
       {[](const SeenSignal& s) {
          return s.y + s.theta[0] * s.y * s.y / s.c[0] +
                 s.theta[1] * s.y * s.y * s.y / (s.c[0] * s.c[0]);
        },
        {},
        {0.03, -0.02},
        {0.15}}},
      {"sensor_quantisation",
       {[](const SeenSignal& s) {
          // The Fourier series of the saw tooth; each term is smaller by the factor r.
          C sum = 0.0;
          double factor = 1.0;
          for (int k = 1; k < 200; ++k) {
            factor *= -s.c[0];
            sum += factor / k * std::sin(2.0 * kPi * k * s.y / s.theta[0]);
          }
          return s.y + s.theta[0] / kPi * sum;
        },
        {},
        {0.02},
        {0.8}}},
      {"series_compliance",
       {[](const SeenSignal& s) { return s.y + s.load / s.theta[0]; }, {}, {5e3}, {}}},
      {"sensor_lag",
       {{}, [](double omega, const T& t) { return 1.0 / C(1.0, omega * t[0]); }, {0.006}, {}}},
      {"sensor_delay",
       {{}, [](double omega, const T& t) { return std::exp(C(0.0, -omega * t[0])); }, {0.004}, {}}},
  };
  return all;
}

}  // namespace shaker::estimator::testing
