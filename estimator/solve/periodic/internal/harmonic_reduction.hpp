// Harmonic reduction (harmonic balance): the periodic solution as a sum of its first few harmonics.
// Where the forces vary slowly over the period, few harmonics of the response matter. Their
// coefficients are the unknowns; the equations of motion hold in their projection on the same
// harmonics (Galerkin). The forces are evaluated on a grid that is fine enough to avoid aliasing.
// The residual outside the projection measures the error of the reduction; harmonics are added
// until it is small.
//
// The thesis mentions the idea for (5.13) and leaves it to its references. The equations here are
// those of the alternating frequency/time method.
//
// A HarmonicReduction is a workspace for one thread; the Model is immutable and may be shared.
// solve() allocates.
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "estimator/solve/periodic/periodic_system.hpp"

namespace shaker::estimator {

struct ReductionOptions {
  int least = 3;           // harmonics to begin with
  int most = 48;           // harmonics at which the reduction stops
  double accuracy = 1e-6;  // permitted truncation error, share of the largest harmonic
};

// Result of a reduction. If `status` is converged but `sufficient` is false, the solution has
// `most` harmonics and an error of about `left_out`.
struct ReducedSolution {
  SolveStatus status = SolveStatus::converged;
  bool sufficient = false;
  int harmonics = 0;
  int iterations = 0;     // Newton steps, the sum over all numbers of harmonics
  double left_out = 0.0;  // estimated truncation error, share of the largest harmonic
  std::string sentence() const;
};

class HarmonicReduction {
 public:
  // `model` must outlive it. Throws std::invalid_argument unless 1 <= least <= most and accuracy is
  // positive.
  HarmonicReduction(const Model& model, ReductionOptions options);

  // Sets the excitation of the table to amplitude * cos(2 pi tau), m/s^2.
  void set_excitation(double frequency_hz, double amplitude);
  // Solves from the last solution; from rest the first time and after a failure. Failures are
  // reported in the status.
  ReducedSolution solve(std::span<const double> theta);

  // Coordinate c of the last solution at cyclic time tau, and its derivative over parameter k. Both
  // have about the same relative accuracy.
  double value(double tau, int c = 0) const;
  double sensitivity(double tau, int k, int c = 0) const;
  // Amplitude of a harmonic, in the model's length unit; harmonic 0 is the modulus of the mean.
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
  // Values and derivatives over the phase (rad) of 1, cos, sin, cos 2, ... at the grid's points.
  Eigen::MatrixXd basis_, first_, second_;
  Eigen::MatrixXd jacobian_;
  Eigen::MatrixXd unknowns_;  // column 0: harmonics of the state; 1 + k: over theta_k
  Eigen::MatrixXd right_;     // column 0: projected residual; 1 + k: of its partial derivative
};

}  // namespace shaker::estimator
