// Periodic responses by Runge-Kutta steps and shooting, independent of the estimator.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::testing {

// amplitude * cos plus the cosine and sine parts of the harmonics, at both ends and in the
// middle of each of `steps` steps.
inline std::vector<double> excitation_table(double amplitude, const std::vector<double>& parts,
                                            int steps) {
  std::vector<double> x;
  for (int i = 0; i <= 2 * steps; ++i) {
    const double angle = std::numbers::pi * i / steps;
    double sum = amplitude * std::cos(angle);
    for (std::size_t m = 0; m < parts.size(); ++m) {
      const double turned = angle * static_cast<double>(1 + m / 2);
      sum += parts[m] * (m % 2 == 0 ? std::cos(turned) : std::sin(turned));
    }
    x.push_back(sum);
  }
  return x;
}

// Integrates d(state)/dt = rate(state, x) over one period; `state` is replaced by the final
// state. Returns the first component at `points` equal steps.
template <std::size_t S, class Rate>
std::vector<double> one_period(const Rate& rate, const std::vector<double>& x, double frequency,
                               std::array<double, S>& state, int points) {
  const auto steps = static_cast<int>(x.size() - 1) / 2;
  const double h = 1.0 / frequency / steps;
  const auto moved = [&](const std::array<double, S>& by, double share) {
    std::array<double, S> out = state;
    for (std::size_t k = 0; k < S; ++k)
      out[k] += share * by[k];
    return out;
  };
  std::vector<double> out;
  for (int i = 0; i < steps; ++i) {
    if (i % (steps / points) == 0) out.push_back(state[0]);
    const double* at = &x[static_cast<std::size_t>(2 * i)];
    const auto k1 = rate(state, at[0]);
    const auto k2 = rate(moved(k1, 0.5 * h), at[1]);
    const auto k3 = rate(moved(k2, 0.5 * h), at[1]);
    const auto k4 = rate(moved(k3, h), at[2]);
    for (std::size_t k = 0; k < S; ++k)
      state[k] += h / 6.0 * (k1[k] + 2.0 * k2[k] + 2.0 * k3[k] + k4[k]);
  }
  return out;
}

// Starts at `state`, which is replaced by the first state of the periodic solution. nullopt
// when there is none nearby.
template <std::size_t S, class Rate>
std::optional<std::vector<double>> periodic_response(const Rate& rate, const std::vector<double>& x,
                                                     double frequency, std::array<double, S>& state,
                                                     int points) {
  using Vector = Eigen::Matrix<double, S, 1>;
  constexpr double kStep = 1e-6;
  for (int iteration = 0; iteration < 20; ++iteration) {
    auto end = state;
    const auto out = one_period(rate, x, frequency, end, points);
    Vector off;
    for (std::size_t k = 0; k < S; ++k)
      off[static_cast<Eigen::Index>(k)] = end[k] - state[k];
    if (!off.allFinite()) return std::nullopt;
    if (off.cwiseAbs().maxCoeff() < 1e-10) return out;
    Eigen::Matrix<double, S, S> slope = Eigen::Matrix<double, S, S>::Identity();
    for (std::size_t k = 0; k < S; ++k) {
      auto beside = state;
      beside[k] += kStep;
      one_period(rate, x, frequency, beside, points);
      for (std::size_t l = 0; l < S; ++l)
        slope(static_cast<Eigen::Index>(l), static_cast<Eigen::Index>(k)) -=
            (beside[l] - end[l]) / kStep;
    }
    const Vector step = slope.partialPivLu().solve(off);
    for (std::size_t k = 0; k < S; ++k)
      state[k] += step[static_cast<Eigen::Index>(k)];
  }
  return std::nullopt;
}

// (6.3): u'' = x + g - theta1 |u'| u' - theta2 (1 - theta3 u)^-theta4.
struct OleoInTime {
  std::vector<double> theta;
  double gravity = 9.80665;

  std::array<double, 2> operator()(const std::array<double, 2>& z, double x) const {
    return {z[1], x + gravity - theta[0] * std::fabs(z[1]) * z[1] -
                      theta[1] * std::pow(1.0 - theta[2] * z[0], -theta[3])};
  }
  // The state at which the spring carries the weight.
  std::array<double, 2> rest() const {
    return {(1.0 - std::pow(theta[1] / gravity, 1.0 / theta[3])) / theta[2], 0.0};
  }
};

// (J^T J)^-1 noise^2 of a response `at(theta)` at equal steps, with J from central differences.
template <class Response>
Eigen::MatrixXd linear_covariance(const Response& at, const std::vector<double>& theta,
                                  double noise) {
  constexpr double kShare = 1e-4;
  Eigen::MatrixXd j;
  for (std::size_t k = 0; k < theta.size(); ++k) {
    std::vector<double> up = theta, down = theta;
    up[k] *= 1.0 + kShare;
    down[k] *= 1.0 - kShare;
    const std::vector<double> high = at(up), low = at(down);
    const auto points = static_cast<Eigen::Index>(high.size());
    if (k == 0) j.resize(points, static_cast<Eigen::Index>(theta.size()));
    j.col(static_cast<Eigen::Index>(k)) = (Eigen::Map<const Eigen::VectorXd>(high.data(), points) -
                                           Eigen::Map<const Eigen::VectorXd>(low.data(), points)) /
                                          (2.0 * kShare * theta[k]);
  }
  return noise * noise * (j.transpose() * j).inverse();
}

}  // namespace shaker::estimator::testing
