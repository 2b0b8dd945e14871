// Monte Carlo (3.2)-(3.4): measures the quality of an estimator on data whose truth is known.
//
// Simulates the same campaign many times with new noise and estimates each one. The result compares
// bias, scatter with the Cramer-Rao bound, stated errors with actual errors, and the coverage of
// the intervals. The data come from an accurate periodic solution, not from the grid of the
// estimator, so that the discretisation error is visible.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "base/shard.hpp"
#include "estimator/fit/estimation.hpp"
#include "estimator/inference/second_order.hpp"

namespace shaker::estimator {

struct RunDesign {
  double frequency_hz = 0.0;
  double amplitude = 0.0;  // m/s^2, of a pure cosine
  int points = 40;         // samples a period
  double cycles = 1.0;     // number of cycles that are averaged
};

enum class NoiseKind { normal, uniform };

struct MonteCarloOptions {
  std::vector<RunDesign> runs;
  std::vector<double> truth;  // of all parameters
  std::vector<double> start;  // of every fit; empty: 1.05 times the truth
  double noise = 0.0;         // standard deviation of one observation
  NoiseKind kind = NoiseKind::normal;
  long replications = 10000;
  std::uint64_t seed = 1;
  unsigned threads = 0;         // 0: one for each core; the result is bitwise the same
  bool profile = false;         // also compute the profile coverage
  Bias bias = Bias::automatic;  // as in a published estimate (second_order.hpp)
  EstimationOptions estimation;
};

// One replication. Only a converged one has more than status and noise; the lists have an entry for
// each free parameter.
struct Replication {
  FitStatus status = FitStatus::not_converged;
  bool on_bound = false;
  Correction bias = Correction::none;
  double noise = 0.0;  // estimated standard deviation
  std::vector<double> theta, error;
  std::vector<char> inside, inside_profile;  // whether the interval holds the truth
};

struct ParameterScore {
  int parameter = 0;
  double truth = 0.0;
  double bias = 0.0;              // mean error
  double scatter = 0.0;           // standard deviation of the estimates
  double bound = 0.0;             // Cramer-Rao: smallest standard deviation of an unbiased estimate
  double second_bound = 0.0;      // Bhattacharyya's, of second order; NaN: not available
  double stated = 0.0;            // root mean square of the stated standard errors
  double coverage = 0.0;          // share of linear intervals that contain the truth
  double profile_coverage = 0.0;  // NaN when not asked for
  double discretisation = 0.0;    // error on noise-free data, in units of `bound`
};

struct MonteCarloResult {
  std::vector<ParameterScore> parameters;  // one for each free parameter
  std::vector<double> covariance;          // of the estimates, free x free
  std::vector<double> bound;               // Cramer-Rao, free x free
  long replications = 0;
  long converged = 0;  // only these enter the statistics
  long undetermined = 0, on_bound = 0;
  // Coverage of the profile intervals of the replications that ended on a bound; NaN without any.
  // These are extreme samples: 95 % is the expectation over all replications, not over these.
  double on_bound_profile_coverage = 0.0;
  // Replications whose bias was subtracted, and those where it could not be subtracted.
  long bias_taken_off = 0, bias_left_in = 0;
  double noise = 0.0;  // mean of the estimated standard deviations
};

// Returns an Error when the options are invalid, when the truth has no periodic solution, or when
// the runs do not determine all free parameters. Throws std::invalid_argument where Estimator does.
Result<MonteCarloResult> monte_carlo(const Model& model, const MonteCarloOptions& options);

// The same in two steps, so that the replications can be made in parts: those of a part, in their
// order, and the result of all options.replications of them, in their order.
Result<std::vector<Replication>> replications(const Model& model, const MonteCarloOptions& options,
                                              const Shard& part = {});
Result<MonteCarloResult> score(const Model& model, const MonteCarloOptions& options,
                               const std::vector<Replication>& all);

// Noise-free data of a design at the truth, from a solution on at least 1600 points a period.
Result<std::vector<RunData>> exact_data(const Model& model, const std::vector<RunDesign>& runs,
                                        const std::vector<double>& truth);

}  // namespace shaker::estimator
