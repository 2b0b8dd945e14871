// Parametric bootstrap: new data are made from the estimate and estimated again, many times.
//
// It asks of the model at hand what Monte Carlo asks of a known truth, so it sees the nonlinearity
// that (3.27) leaves out: bias, the errors that really occur, and intervals from the studentised
// errors t* = (theta* - theta) / error*, which need not be symmetric.
#pragma once

#include <cstdint>
#include <vector>

#include "estimator/estimation.hpp"

namespace shaker::estimator {

struct BootstrapOptions {
  long replications = 1000;
  std::uint64_t seed = 1;
  unsigned threads = 0;  // 0: as many as there are; the result is the same
  EstimationOptions estimation;
};

struct BootstrapInterval {
  int parameter = 0;
  double bias = 0.0;            // mean of theta* less theta
  double standard_error = 0.0;  // of theta*
  double lower = 0.0, upper = 0.0;
};

struct Bootstrap {
  std::vector<BootstrapInterval> intervals;  // of the free parameters
  long replications = 0, converged = 0;
};

// `estimator` holds a converged fit of `runs`, samples or Fourier coefficients; noise is normal
// with what the fit found. Throws std::invalid_argument for fewer than 100 replications.
Bootstrap bootstrap(const Model& model, const Estimator& estimator,
                    const std::vector<RunData>& runs, const BootstrapOptions& options);

}  // namespace shaker::estimator
