// Every candidate scored by the part of its signature that the model's parameters cannot imitate.
//
// A signature is the change of all runs' harmonics per unit of the effect's coefficient, at the
// fitted solution: one linearisation of the model that holds the effect at "absent", with the
// effect's memory driven along the known motion. What is left of it after projecting out the
// parameters is held against what is left of the data.
#pragma once

#include <string>
#include <vector>

#include "estimator/diagnosis/fit/harmonic_fit.hpp"
#include "estimator/diagnosis/score/calibration.hpp"
#include "estimator/diagnosis/score/candidates.hpp"

namespace shaker::estimator::diagnosis {

struct Score {
  const Candidate* candidate = nullptr;
  std::size_t probe = 0;
  std::size_t coefficient = 0;  // of the probe
  Eigen::VectorXd signature;    // whitened, all runs that are fitted
  double value = 0.0;           // of the coefficient over its absent value, by linear regression
  double gain = 0.0;            // in chi-squared; 0 when the sign is inadmissible
};

// A candidate of which no shape could be scored, and why.
struct NotScored {
  const Candidate* candidate = nullptr;
  std::string reason;
};

struct Scoring {
  Design design;             // signatures in the order of `scores`
  Eigen::VectorXd residual;  // whitened, with the parameters' part projected out
  double chi_squared = 0.0;
  std::vector<Score> scores;
  std::vector<NotScored> not_scored;
  double best_gain() const;
};

Scoring score(const HarmonicFit& fit, const std::vector<RunDatum>& data,
              const std::vector<Candidate>& candidates, const FitOptions& options);

struct Signatures {
  Eigen::MatrixXd columns;  // whitened: one a coefficient, or one of the whole difference
  std::string trouble;      // why there are none; empty: there are
};
Signatures signatures_of(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                         const Probe& probe, const FitOptions& options);

// Residuals and Jacobian of the runs that are fitted, one below the other.
Eigen::VectorXd stacked_residual(const HarmonicFit& fit, const std::vector<RunDatum>& data);
Eigen::MatrixXd stacked_jacobian(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                 const std::vector<int>& columns);

// The model with a line added behind.
config::ModelSpec with_line(const config::ModelSpec& spec, const config::EffectSpec& line);
// Values of `fit` for the parameters that a model shares with it, its own start for the others.
std::vector<double> carried_over(const Model& model, const HarmonicFit& fit);

}  // namespace shaker::estimator::diagnosis
