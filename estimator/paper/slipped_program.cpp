#include "estimator/paper/internal/slipped_program.hpp"

#include <cmath>

#include <Eigen/Dense>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::paper {
namespace {

constexpr double kTimeStep = 0.01;
// One column for the state, one for each of its derivatives over (u0, u0', theta1, .. theta4).
using Augmented = Eigen::Matrix<double, 2, 7>;

Augmented rate(const Augmented& s, const std::vector<double>& p, double gravity, double slope) {
  const double u = s(0, 0), v = s(1, 0);
  const double wall = 1.0 - p[4] * u;
  const double gas = p[3] * std::pow(wall, -p[5]);
  Augmented out;
  out.row(0) = s.row(1);
  out(1, 0) = gravity - p[2] * std::fabs(v) * v - gas;
  const double over_u = -gas * p[4] * p[5] / wall;     // (A.2)
  const double over_v = -slope * p[2] * std::fabs(v);  // (A.3); slope is 2 there
  for (int k = 1; k < 7; ++k)
    out(1, k) = over_u * s(0, k) + over_v * s(1, k);
  out(1, 3) -= std::fabs(v) * v;
  out(1, 4) -= gas / p[3];
  out(1, 5) -= gas * p[5] * u / wall;
  out(1, 6) += gas * std::log(wall);
  return out;
}

Augmented first_state(const std::vector<double>& p) {
  Augmented s = Augmented::Zero();
  s(0, 0) = p[0];
  s(1, 0) = p[1];
  s(0, 1) = s(1, 2) = 1.0;
  return s;
}

void step(Augmented& s, const std::vector<double>& p, double gravity, double slope) {
  const Augmented k1 = rate(s, p, gravity, slope);
  const Augmented k2 = rate(s + 0.5 * kTimeStep * k1, p, gravity, slope);
  const Augmented k3 = rate(s + 0.5 * kTimeStep * k2, p, gravity, slope);
  const Augmented k4 = rate(s + kTimeStep * k3, p, gravity, slope);
  s += kTimeStep / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
}

}  // namespace

std::vector<double> SlippedProgram::response(const std::vector<double>& p, int samples) const {
  std::vector<double> u;
  Augmented s = first_state(p);
  for (int i = 0; i < samples; ++i) {
    if (i > 0) step(s, p, gravity, damping_slope);
    u.push_back(s(0, 0));
  }
  return u;
}

std::vector<std::vector<double>> SlippedProgram::iterate(std::span<const double> data,
                                                         std::vector<double> p,
                                                         int iterations) const {
  std::vector<std::vector<double>> out;
  const auto n = static_cast<Eigen::Index>(data.size());
  for (int i = 0; i < iterations; ++i) {
    Eigen::MatrixXd jacobian(n, 6);
    Eigen::VectorXd residual(n);
    Augmented s = first_state(p);
    for (Eigen::Index row = 0; row < n; ++row) {
      if (row > 0) step(s, p, gravity, damping_slope);
      jacobian.row(row) = s.row(0).tail(6);
      residual[row] = data[static_cast<std::size_t>(row)] - s(0, 0);
    }
    const Eigen::VectorXd delta = least_squares_by_singular_values(jacobian, residual);
    for (std::size_t k = 0; k < 6; ++k)
      p[k] += delta[static_cast<Eigen::Index>(k)];
    out.push_back(p);
  }
  return out;
}

}  // namespace shaker::estimator::paper
