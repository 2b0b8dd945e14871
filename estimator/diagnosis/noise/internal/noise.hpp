// The noise of a campaign's mean harmonics, from the scatter of its cycles alone.
//
// Each run and harmonic has its own variance, since noise is coloured. A dozen cycles determine it
// badly. Therefore the estimates of all runs and harmonics are combined: a trend over frequency and
// run, and an inverse-gamma prior about the trend. The width of the prior follows from how much the
// variances differ beyond chance (Smyth 2004). White noise then has nearly the degrees of freedom
// of all cycles together; coloured noise keeps its own few.
//
// Noise that is correlated from cycle to cycle makes the mean less certain than scatter / cycles.
// Its low-frequency share is measured and included.
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
  // Degrees of freedom that each component has lost, apart from its mean; empty: none.
  Eigen::VectorXd spent = {};
};

CampaignNoise campaign_noise(const std::vector<Scatter>& runs);

// Moderates variances: takes independent estimates in `variance` and `freedom`, and leaves the
// posterior ones there. `trend` has a row of covariates for each, the constant first.
void moderate(const Eigen::MatrixXd& trend, Eigen::VectorXd& variance, Eigen::VectorXd& freedom);

}  // namespace shaker::estimator::diagnosis
