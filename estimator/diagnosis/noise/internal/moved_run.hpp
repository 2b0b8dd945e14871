// The response of a run whose constants (run_constants.hpp) are not those of the others.
#pragma once

#include <optional>

#include <Eigen/Dense>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"

namespace shaker::estimator::diagnosis {

// Of a run: zero of the response (its unit), constant force (the model's unit), gas pressure and
// viscous damping (relative).
inline constexpr int kRunConstants = 4;
using RunConstantValues = Eigen::Vector<double, kRunConstants>;

// Index of an effect's parameter; -1: the model does not hold it.
int parameter_of(const Model& model, const std::string& effect, const std::string& symbol);

// About the constants of a run, to first order.
struct MovedRun {
  // What the response at the constants has more than their influence says: harmonics.
  Eigen::VectorXd bend;
  Eigen::MatrixXd influence;  // harmonics x kRunConstants
};
// Of run `r` of `fit`, a periodic one. Nothing where it has no periodic solution there.
std::optional<MovedRun> moved_run(const HarmonicFit& fit, const RunDatum& datum, std::size_t r,
                                  const RunConstantValues& constants);

}  // namespace shaker::estimator::diagnosis
