/// \file
/// A fit from several starts. The sum of squares has valleys without a good minimum (a damper so
/// stiff that nothing moves fits any record with its mean), and a single bad start can end in one.
///
/// The starts fill the box of the parameters with a Sobol sequence, shifted at random by the seed.
/// The scale is logarithmic if a parameter is positive and its range spans more than a decade. The
/// range of a positive parameter ends at `span` times its start, or at a nearer bound. The sum of
/// squares is evaluated at many points (one periodic solution of each run). The fits begin at the
/// given start and at the best of these points that lie apart.
#pragma once

#include <cstdint>
#include <vector>

#include "estimator/fit/estimation.hpp"

namespace shaker::estimator {

/// How many starts, and where.
struct StartOptions {
  int starts = 8;        ///< fits, the one from the given start among them
  int looks = 64;        ///< evaluations of the sum of squares for each start
  double span = 1000.0;  ///< widest range of a positive parameter: factor above and below its start
  std::uint32_t seed = 1;  ///< shifts the starts
};

/// A point where at least one fit ended.
struct Minimum {
  FitStatus status = FitStatus::not_converged;  ///< how the fits ended
  std::vector<double> theta;                    ///< all parameters of the model
  double sum_of_squares = 0.0;                  ///< of weighted residuals
  std::vector<std::vector<double>> from;        ///< the starts that ended here
};

/// Where the fits ended.
struct Minima {
  /// Distinct; converged ones first, each group by increasing sum of squares.
  std::vector<Minimum> found;
  int admissible = 0;  ///< points with a periodic solution
  int looks = 0;       ///< points that were evaluated
};

/// Throws std::invalid_argument as Estimator does. One thread; allocates.
/// \param model the model
/// \param runs the data, one element for each run
/// \param how how each fit steps
/// \param start all parameters of the model; it need not have a periodic solution
/// \param options how many starts, and where
/// \return the minima; `found` is empty when no start had a periodic solution
Minima several_starts(const Model& model, const std::vector<RunData>& runs,
                      const EstimationOptions& how, const std::vector<double>& start,
                      const StartOptions& options);

}  // namespace shaker::estimator
