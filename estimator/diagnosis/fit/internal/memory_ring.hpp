// The linearised equations of a model's memories (internal states) along a known periodic motion:
// Newton's step for all points of the cycle, and the memories' derivatives over the parameters.
#pragma once

#include <optional>

#include <Eigen/Dense>

#include "estimator/math/aligned.hpp"
#include "estimator/math/cyclic_banded_lu.hpp"
#include "estimator/model/model.hpp"
#include "estimator/model/model_arrays.hpp"
#include "estimator/solve/periodic/scheme.hpp"

namespace shaker::estimator::diagnosis {

class MemoryRing {
 public:
  // The memories are the coordinates of `model` from 1 on; it has at least one.
  MemoryRing(const Model& model, double frequency_hz, int points);

  // Writes the rates over time of the memories `at.u` into `at.v`.
  void differentiate(ModelArrays& at);
  // Solves the equations that `at` holds, as Model::evaluate has filled it. Returns false if they
  // are singular.
  bool solve(const ModelArrays& at);
  // The solution for one memory at one point: Newton's step, then the derivative over each
  // parameter.
  const double* row(int point, int memory) const {
    return &rows_[static_cast<std::size_t>((point * memories_ + memory) * stride_)];
  }
  // Adds what the memories do to the force: over_w and over_rate are its derivatives over a memory
  // and its rate at each point; slope is points x parameters.
  void add_to_slope(int memory, const double* over_w, const double* over_rate,
                    Eigen::MatrixXd& slope) const;

 private:
  void fill_rows(const ModelArrays& at);
  bool solve_ring(const ModelArrays& at);
  bool solve_with_exchanges(const ModelArrays& at);

  int n_, s_, p_, memories_;
  double steps_per_second_;
  Stencil stencil_ = upwind_stencil(Scheme::order4);
  int stride_;
  AlignedVector band_, upper_, rows_;  // of ring_step.hpp; no band if it has no such solver
  std::optional<CyclicBandedLu> exchanging_;
  Eigen::VectorXd closed_;  // one ring with its ends repeated
};

}  // namespace shaker::estimator::diagnosis
