// An independent implementation of every effect, from the table of the catalogue and not from
// its code, in complex arithmetic: complex steps through it check the partial derivatives.
#pragma once

#include <complex>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace shaker::estimator::testing {

using C = std::complex<double>;

// The variables of a formula; `t` has the own and the borrowed parameters, `c` the constants.
struct Seen {
  C u, v, a, x;
  std::vector<C> w, w_dot, w_ddot;
  std::vector<C> t;
  std::vector<double> c;
  double x_quadrature = 0.0, carrier_cos = 0.0, carrier_sin = 0.0, carrier_amplitude = 0.0,
         carrier_omega = 0.0;
  std::vector<double> harmonics;
};

struct Formula {
  std::function<std::vector<C>(const Seen&)> equations;  // force, then a row per internal state
  std::vector<double> theta, constants;                  // theta includes borrowed ones
};
const std::map<std::string, Formula>& formulas();

// Instruments: y of (signal, load, time), or a transfer function of (omega).
struct SeenSignal {
  C y, load, t;
  std::vector<C> theta;
  std::vector<double> c;
};
struct Sensing {
  std::function<C(const SeenSignal&)> pointwise;
  std::function<C(double omega, const std::vector<double>& theta)> transfer;
  std::vector<double> theta, constants;
};
const std::map<std::string, Sensing>& sensings();

}  // namespace shaker::estimator::testing
