// The noise of a campaign's mean harmonics, from nothing but the scatter of its cycles.
//
// Each run and harmonic has its own variance (noise is coloured), but a dozen cycles determine it
// badly; so the variances of all runs and harmonics lend each other strength: a trend over
// frequency and run, and an inverse-gamma prior about it whose width comes from how much the
// variances differ more than chance lets them (Smyth 2004). White noise so gets nearly the
// degrees of freedom of all cycles together, noise with a colour of its own keeps its own few.
//
// Noise that is correlated from one cycle to the next makes the mean worse than scatter /
// cycles; its low-frequency share is measured and taken into account.
#pragma once

#include <vector>

#include <Eigen/Dense>

namespace shaker::estimator::diagnosis {

struct RunNoise {
  Eigen::VectorXd variance;  // of the mean over the cycles, a component of the harmonics each
  Eigen::VectorXd freedom;   // degrees of freedom behind each
};

struct CampaignNoise {
  std::vector<RunNoise> runs;
  double variance_inflation =
      1.0;  // variance of the means over scatter / cycles; 1: cycles independent
};

struct Scatter {
  double frequency_hz = 0.0;
  Eigen::MatrixXd cycles;  // a row a cycle, in order of time; at least 3
  // Degrees of freedom that were taken from each component besides its mean; empty: none.
  Eigen::VectorXd spent = {};
};

CampaignNoise campaign_noise(const std::vector<Scatter>& runs);

// Moderated variances: `variance` and `freedom` of independent estimates in, posterior ones out.
// `trend` has a row of covariates for each (a constant first).
void moderate(const Eigen::MatrixXd& trend, Eigen::VectorXd& variance, Eigen::VectorXd& freedom);

}  // namespace shaker::estimator::diagnosis
