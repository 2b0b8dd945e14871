// Harmonic reduction: the periodic solution by its first few harmonics. Where the forces vary
// slowly over the period, the response has few harmonics that matter; these alone are the unknowns,
// and the equations of motion hold in their projection on the same harmonics (Galerkin), with the
// forces taken on a grid fine enough that their products do not fold back. What the projection
// leaves of the residual says how good the reduction is, and more harmonics are taken until that is
// small.
//
// The thesis names the idea for (5.13) and leaves it to its references; the equations here are
// those of harmonic balance by alternating frequency and time.
//
// One thread beside an immutable Model, as PeriodicSystem; allocates when harmonics are added.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "estimator/periodic/periodic_system.hpp"

namespace shaker::estimator {

struct ReductionOptions {
  int least = 3;           // harmonics to begin with
  int most = 48;           // then it gives up
  double accuracy = 1e-6;  // of the displacement's largest harmonic: what may be left out
};

// What the reduction found. With `status` converged but not `sufficient` the solution is that of
// `most` harmonics and is off by about `left_out`.
struct ReducedSolution {
  SolveStatus status = SolveStatus::converged;
  bool sufficient = false;
  int harmonics = 0;
  int iterations = 0;     // Newton steps, all numbers of harmonics together
  double left_out = 0.0;  // estimated, share of the largest harmonic
  std::string sentence() const;
};

class HarmonicReduction {
 public:
  // `model` must outlive it. Throws std::invalid_argument unless 1 <= least <= most and accuracy is
  // positive.
  HarmonicReduction(const Model& model, ReductionOptions options);

  // amplitude * cos(2 pi tau), from the table.
  void set_excitation(double frequency_hz, double amplitude);
  // From the last solution; the first time from rest. Never throws.
  ReducedSolution solve(std::span<const double> theta);

  // Of the last solution, coordinate c at cyclic time tau: the state, and its derivative over
  // parameter k (sensitivities hold to about the same accuracy as the state).
  double value(double tau, int c = 0) const;
  double sensitivity(double tau, int k, int c = 0) const;
  // Amplitude of a harmonic, the model's length unit.
  double amplitude(int harmonic, int c = 0) const;
  int harmonics() const { return harmonics_; }

 private:
  void resize(int harmonics);
  SolveReport newton(std::span<const double> theta);
  bool linearise(std::span<const double> theta);
  double left_out() const;
  double series(Eigen::Index column, double tau, int c) const;

  const Model* model_;
  ReductionOptions options_;
  double frequency_ = 1.0, amplitude_ = 0.0;
  int harmonics_ = 0;
  bool solved_ = false;
  std::unique_ptr<PeriodicSystem> grid_;
  // Values, first and second derivative over time of 1, cos, sin, cos 2, ... on the grid.
  Eigen::MatrixXd basis_, first_, second_;
  Eigen::MatrixXd jacobian_;
  Eigen::MatrixXd unknowns_;  // column 0: harmonics of the state; 1 + k: over theta_k
  Eigen::MatrixXd right_;     // column 0: projected residual; 1 + k: of its partial derivative
};

}  // namespace shaker::estimator
