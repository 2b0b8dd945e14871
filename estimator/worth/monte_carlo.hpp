// Monte Carlo (3.2)-(3.4): what an estimator is worth on data whose truth is known.
//
// Makes the same campaign many times with new noise, estimates each, and compares: bias, scatter
// against the Cramer-Rao bound, the errors that were stated against the errors that were made, and
// how often the intervals hold the truth. The data come from an accurate periodic solution, not
// from the estimating grid, so that discretisation shows as what it is.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/estimation.hpp"
#include "estimator/worth/second_order.hpp"

namespace shaker::estimator {

struct RunDesign {
  double frequency_hz = 0.0;
  double amplitude = 0.0;  // of a pure cosine
  int points = 40;         // a period
  double cycles = 1.0;     // averaged
};

enum class NoiseKind { normal, uniform };

struct MonteCarloOptions {
  std::vector<RunDesign> runs;
  std::vector<double> truth;  // all parameters
  std::vector<double> start;  // of every fit; empty: the truth, 5 % off
  double noise = 0.0;         // standard deviation of one observation
  NoiseKind kind = NoiseKind::normal;
  long replications = 10000;
  std::uint64_t seed = 1;
  unsigned threads = 0;         // 0: as many as there are; the result is the same, bit by bit
  bool profile = false;         // profile intervals, too
  Bias bias = Bias::automatic;  // what is scored is what would be published (second_order.hpp)
  EstimationOptions estimation;
};

struct ParameterScore {
  int parameter = 0;
  double truth = 0.0;
  double bias = 0.0;              // mean error
  double scatter = 0.0;           // standard deviation of the estimates
  double bound = 0.0;             // Cramer-Rao: smallest standard deviation without bias
  double second_bound = 0.0;      // Bhattacharyya's, of second order; NaN: not to be had
  double stated = 0.0;            // root mean square of the standard errors given
  double coverage = 0.0;          // share of linear intervals that held the truth
  double profile_coverage = 0.0;  // NaN when not asked for
  double discretisation = 0.0;    // error on data without noise, in multiples of `bound`
};

struct MonteCarloResult {
  std::vector<ParameterScore> parameters;  // free ones
  std::vector<double> covariance;          // of the estimates, free x free
  std::vector<double> bound;               // Cramer-Rao, free x free
  long replications = 0;
  long converged = 0;  // the rest counts nowhere above but here
  long undetermined = 0, on_bound = 0;
  // Of the profile intervals of those that ended on a bound, the share that held the truth; NaN
  // when there is none. They are extreme draws: 95 % is expected of all, not of them.
  double on_bound_profile_coverage = 0.0;
  // Replications without their bias of second order, and those where it had to be left in.
  long bias_taken_off = 0, bias_left_in = 0;
  double noise = 0.0;  // mean of the estimated ones
  double seconds = 0.0;
};

// An Error when the truth itself has no periodic solution or the options contradict each other;
// throws std::invalid_argument where Estimator does.
Result<MonteCarloResult> monte_carlo(const Model& model, const MonteCarloOptions& options);

// Noise-free data of a design at the truth, from a solution on a grid ten times as fine.
Result<std::vector<RunData>> exact_data(const Model& model, const std::vector<RunDesign>& runs,
                                        const std::vector<double>& truth);

}  // namespace shaker::estimator
