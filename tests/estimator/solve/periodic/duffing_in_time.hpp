// x'' + c x' + k x + k3 x^3 = load + amplitude cos(omega t), integrated by Odeint and
// independent of the estimator.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <boost/numeric/odeint.hpp>

namespace shaker::estimator::testing {

using State = std::array<double, 2>;

struct DuffingInTime {
  std::vector<double> theta;  // c, k, k3
  double load, omega, amplitude;
  double tolerance = 1e-11;

  void operator()(const State& y, State& d, double t) const {
    d[0] = y[1];
    d[1] = load + amplitude * std::cos(omega * t) - theta[0] * y[1] - theta[1] * y[0] -
           theta[2] * y[0] * y[0] * y[0];
  }
  // Integrates from phase `from` to phase `to`, in periods.
  State advance(State y, double from, double to) const {
    namespace odeint = boost::numeric::odeint;
    const double period = 2.0 * std::numbers::pi / omega;
    odeint::integrate_adaptive(
        odeint::make_controlled<odeint::runge_kutta_dopri5<State>>(tolerance, tolerance), *this, y,
        from * period, to * period, 1e-3 * period);
    return y;
  }
  State after_periods(State y, int periods) const {
    for (int k = 0; k < periods; ++k)
      y = advance(y, 0.0, 1.0);
    return y;
  }
  // The motion at `points` equal steps over `periods` periods.
  std::vector<double> record(State y, int periods, int points) const {
    std::vector<double> x;
    for (int j = 0; j < points; ++j) {
      x.push_back(y[0]);
      y = advance(y, static_cast<double>(j) * periods / points,
                  static_cast<double>(j + 1) * periods / points);
    }
    return x;
  }
};

}  // namespace shaker::estimator::testing
