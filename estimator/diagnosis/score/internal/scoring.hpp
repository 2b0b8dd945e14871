// Scores every candidate by the part of its signature that the model's parameters cannot imitate.
//
// A signature is the change of all runs' harmonics per unit of the effect's coefficient, at the
// fitted solution. It takes one linearisation of the model with the effect at its absent value,
// with the memory of the effect driven along the known motion. The parameters are projected out of
// the signature and of the residual, and the two are compared.
#pragma once

#include <compare>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "estimator/diagnosis/fit/internal/harmonic_fit.hpp"
#include "estimator/diagnosis/score/calibration.hpp"
#include "estimator/diagnosis/score/internal/candidates.hpp"

namespace shaker::estimator::diagnosis {

struct Score {
  const Candidate* candidate = nullptr;
  std::size_t probe = 0;
  std::size_t coefficient = 0;  // of the probe
  Eigen::VectorXd signature;    // whitened, all runs that are fitted
  double value = 0.0;           // of the coefficient over its absent value, by linear regression
  double gain = 0.0;            // in chi-squared; 0 when the sign is inadmissible
};

// A candidate without a shape that could be scored, and the reason.
struct NotScored {
  const Candidate* candidate = nullptr;
  std::string reason;
  bool stopped = false;  // the evaluation budget ended the look at one of its shapes
};

// A run's prediction by a model that holds a probe.
struct ProbedRun {
  std::shared_ptr<const Model> model;
  std::shared_ptr<Prediction> prediction;  // null: the run is not fitted
};
using ProbedRuns = std::vector<ProbedRun>;
// The change of a run's harmonics by a probe, along an imposed motion of which it is known.
struct KnownChange {
  double frequency_hz = 0.0;
  Eigen::VectorXd motion;
  Eigen::MatrixXd columns;
};
// What is known of a probe from one fit: the solutions, from which those on another fit of the same
// runs start, or the changes, if they do not depend on the fit.
struct Probed {
  ProbedRuns runs;
  std::vector<KnownChange> changes;
};
// `points`, `corners`: where the changes do not depend on the fit, those of the grid and those that
// the corners are made for; otherwise 0.
struct ProbeKey {
  const Candidate* candidate = nullptr;
  std::size_t probe = 0;
  int points = 0, corners = 0;
  auto operator<=>(const ProbeKey&) const = default;
};
using ProbedAll = std::map<ProbeKey, Probed>;

struct Scoring {
  Design design;             // signatures in the order of `scores`
  Eigen::VectorXd residual;  // whitened, with the parameters' part projected out
  double chi_squared = 0.0;
  std::vector<Score> scores;
  std::vector<NotScored> not_scored;
  std::shared_ptr<ProbedAll> probed;  // along an imposed motion
  double best_gain() const;
  bool has(const Candidate& candidate, std::size_t probe) const;  // that it has a score
};

// `before`: the scores of the same candidates on another fit. Shapes that had no solution there are
// left out. Null: all shapes are scored. `probed`: of another scoring of the same candidates and
// runs, which this one uses and adds to; may be null.
Scoring score(const HarmonicFit& fit, const std::vector<RunDatum>& data,
              const std::vector<Candidate>& candidates, const FitOptions& options,
              const Scoring* before = nullptr, std::shared_ptr<ProbedAll> probed = nullptr);

struct Signatures {
  Eigen::MatrixXd columns;  // whitened: one a coefficient, or one of the whole difference
  std::string trouble;      // why there are none; empty: there are
  bool stopped = false;     // by the evaluation budget
  Probed probed;
};
// `near`: the same probe on another fit; may be null.
Signatures signatures_of(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                         const Probe& probe, const FitOptions& options,
                         const Probed* near = nullptr);

// Residuals and Jacobian of the fitted runs, one run after another.
Eigen::VectorXd stacked_residual(const HarmonicFit& fit, const std::vector<RunDatum>& data);
Eigen::MatrixXd stacked_jacobian(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                                 const std::vector<int>& columns);

// Returns the model with one more line at its end.
config::ModelSpec with_line(const config::ModelSpec& spec, const config::EffectSpec& line);
// Returns the parameters of `model`: those of `fit` where both have them, otherwise the model's
// start values.
std::vector<double> carried_over(const Model& model, const HarmonicFit& fit);

}  // namespace shaker::estimator::diagnosis
