// Constants that may differ from run to run without a missing effect: the sensor's zero, a constant
// force (the preload, the load cell's zero), the gas pressure (the charge, the temperature), and
// the viscous damping (the temperature).
//
// Each is a normally distributed number in each run, with one standard deviation for all runs. It
// enters the covariance of a run's errors. Therefore it costs no parameter, and a campaign with
// equal runs loses nothing. What is not straight in it is taken about each run's likeliest numbers
// (Lindstrom and Bates, Biometrics 46 (1990) 673-687).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/noise/internal/moved_run.hpp"

namespace shaker::estimator::diagnosis {

// Standard deviations over the runs.
struct RunConstants {
  double zero = 0.0;                         // of the response, in its own unit
  double force = 0.0;                        // in the model's unit of force
  double gas_pressure = 0.0, damping = 0.0;  // relative
  // Logarithm of the likelihood ratio with and without them, at the fit.
  double gain = 0.0;
  int count() const {  // those that differ
    return static_cast<int>(zero > 0.0) + static_cast<int>(force > 0.0) +
           static_cast<int>(gas_pressure > 0.0) + static_cast<int>(damping > 0.0);
  }
  // Words for the operator: which of them differ, and by how much.
  std::string words(const std::string& response_unit, const std::string& force_unit) const;
};

struct WithRunConstants {
  RunConstants constants;
  // With their covariance, less what is not straight in the constants.
  std::vector<RunDatum> data;
  RunConstantValues sizes;  // standard deviations
  std::vector<Eigen::MatrixXd>
      influence;  // of each datum that is fitted: harmonics x kRunConstants
};

// Estimates the standard deviations from the residual of `fit`, which was fitted to `fitted`, by
// restricted maximum likelihood (Harville, Journal of the American Statistical Association 72
// (1977) 320-338), and adds them to the covariance of `data`. `before`: what these are fits of
// already, whose likeliest constants they are taken about; null: about none. Empty if no constant is
// worth a number more, or for fewer than three runs.
std::optional<WithRunConstants> with_run_constants(const HarmonicFit& fit,
                                                   const std::vector<RunDatum>& fitted,
                                                   const std::vector<RunDatum>& data,
                                                   const FitOptions& options,
                                                   const WithRunConstants* before = nullptr);
// True where they explain more than chance does: four sizes at their bound have it by chance once in
// 1000.
bool beyond_chance(const RunConstants& constants);

// The responses of `fitted` less the likeliest part of the constants: what `fit`, which was fitted
// to `with`, leaves of them is noise and what the model lacks. `fitted`: as given to
// with_run_constants.
std::vector<RunDatum> without_constants(const HarmonicFit& fit, const std::vector<RunDatum>& with,
                                        const std::vector<RunDatum>& fitted);

// For records and imposed motion: tests whether the means of the runs differ from those of `fit` by
// more than the noise and by more than a tenth of the missed motion (a missing effect moves means
// too). Two things are added to the error of the mean in `data`, and stored in own_zero:
//  - The scatter of the means of several recordings, as of another zero or preload of each.
//  - The mean of all, where the model makes no force at rest in its zero: of forces, which a preload
//    or the load cell's zero moves, and of a single recording of a displacement, whose zero is a
//    choice of whoever recorded it.
// Means of forces stay visible if any recording goes to one side: friction makes them too.
// Returns a sentence with each run's own mean; empty if neither is there. `unit`: unit of the
// response.
std::string let_zeros_differ(const HarmonicFit& fit, const std::string& unit,
                             std::vector<RunDatum>& data);

}  // namespace shaker::estimator::diagnosis
