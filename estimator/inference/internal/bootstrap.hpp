// Parametric bootstrap: simulates new data from an estimate and estimates them again, many
// times.
//
// Monte Carlo (monte_carlo.hpp) tests an estimator at a known truth; the bootstrap tests it at
// the estimate itself. It shows the nonlinearity that (3.27) neglects: the bias, the actual
// errors, and intervals from the studentised errors t* = (theta* - theta) / error*, which need
// not be symmetric.
#pragma once

#include <cstdint>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

struct BootstrapOptions {
  long replications = 1000;
  std::uint64_t seed = 1;
  unsigned threads = 0;  // 0: one for each core; the result does not depend on it
  EstimationOptions estimation;
};

struct BootstrapInterval {
  int parameter = 0;
  double bias = 0.0;            // mean of theta* - theta
  double standard_error = 0.0;  // standard deviation of theta*
  double lower = 0.0, upper = 0.0;
};

struct Bootstrap {
  std::vector<BootstrapInterval> intervals;  // one for each free parameter
  long replications = 0, converged = 0;
};

// `estimator` holds a converged fit of `runs` (samples or Fourier coefficients). The simulated
// noise is normal, with the standard deviation or covariance of the fit. The statistics use the
// converged replications only. Throws std::invalid_argument for fewer than 100 replications.
Bootstrap bootstrap(const Model& model, const Estimator& estimator,
                    const std::vector<RunData>& runs, const BootstrapOptions& options);

}  // namespace shaker::estimator
