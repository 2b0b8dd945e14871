// What differs from run to run and is no missing effect: the sensor's zero, a constant force (the
// preload, the load cell's zero), the gas pressure (the charge, the temperature), the viscous damping
// (the temperature).
//
// Each is a normal number of its own in each run, with a standard deviation that all runs share. It
// enters the covariance of a run's errors, so that it costs no parameter and a campaign with equal
// runs loses nothing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"

namespace shaker::estimator::diagnosis {

// Standard deviations over the runs.
struct RunConstants {
  double zero = 0.0;                         // of the response, in its own unit
  double force = 0.0;                        // in the model's unit of force
  double gas_pressure = 0.0, damping = 0.0;  // relative
  // Log of the likelihood with them over that without, at the fit.
  double gain = 0.0;
  int count() const {  // those that differ
    return static_cast<int>(zero > 0.0) + static_cast<int>(force > 0.0) +
           static_cast<int>(gas_pressure > 0.0) + static_cast<int>(damping > 0.0);
  }
  // For the operator: which differ, and by how much.
  std::string sentence(const std::string& response_unit, const std::string& force_unit) const;
};

struct WithRunConstants {
  RunConstants constants;
  std::vector<RunDatum> data;  // with their covariance
};

// The likeliest ones for what `fit`, fitted to `fitted`, leaves (restricted likelihood: Harville,
// Journal of the American Statistical Association 72 (1977) 320-338), in the covariance of `data`.
// Nothing where they explain no more than chance does, or for fewer than three runs.
std::optional<WithRunConstants> with_run_constants(const HarmonicFit& fit,
                                                   const std::vector<RunDatum>& fitted,
                                                   const std::vector<RunDatum>& data,
                                                   const FitOptions& options);

}  // namespace shaker::estimator::diagnosis
