#include "tests/estimator/effects/formulas.hpp"

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

}  // namespace

const std::map<std::string, Formula>& formulas() {
  using E = std::vector<C>;
  static const std::map<std::string, Formula> all = {
      {"orifice_damping",
       {[](const Seen& s) { return E{s.t[0] * magnitude(s.v) * s.v}; }, {16.6667}, {}}},
      {"gas_spring",
       {[](const Seen& s) { return E{gas(s.u, s.t[0], s.t[1], s.t[2])}; },
        {1.524, 5.31496, 1.2},
        {}}},
      {"gravity", {[](const Seen& s) { return E{-s.c[0]}; }, {}, {9.8}}},
      {"linear_stiffness",
       {[](const Seen& s) { return E{s.t[0] * (s.u - s.c[0])}; }, {7.5}, {0.03}}},
      {"cubic_stiffness",
       {[](const Seen& s) { return E{s.t[0] * std::pow(s.u - s.c[0], 3)}; }, {0.8}, {-0.02}}},
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
      {"exciter_gain", {[](const Seen& s) { return E{-(s.t[0] - 1.0) * s.x}; }, {1.04}, {}}},
  };
  return all;
}

const std::map<std::string, Sensing>& sensings() {
  using T = std::vector<double>;
  static const std::map<std::string, Sensing> all = {
      {"sensor_gain", {[](const SeenSignal& s) { return s.theta[0] * s.y; }, {}, {1.03}, {}}},
      {"sensor_delay",
       {{}, [](double omega, const T& t) { return std::exp(C(0.0, -omega * t[0])); }, {0.004}, {}}},
  };
  return all;
}

}  // namespace shaker::estimator::testing
