// A model with measured periods as a least-squares problem for the methods of this folder. theta
// are the model's free parameters; e = sqrt(weight) (y - u(tau; theta)) with the periodic solution
// u.
//
// A theta without a periodic solution, or with one that reaches the wall of the gas spring, is
// inadmissible. Each solution starts from the last good one; if Newton's method fails from there,
// it starts from rest with continuation in the amplitude.
//
// Second derivatives come from second-order sensitivities. With the discretised equations
// G(z, theta) = 0, G_z z_k = -G_k (5.24). A further differentiation gives, point by point,
//     G_z z_kl = -(second derivative of g along w_k and w_l),   w_k = (u_k, v_k, a_k, e_k).
// One factorisation serves all pairs k, l. The second derivative of g along w_l is a fourth-order
// central difference of the effects' exact derivatives (1e-11 relative), so every effect of the
// catalogue has it. It is exact for difference schemes without the correction of kinks, and of the
// correction's own order with it. Fourier grids have no second derivatives.
//
// Use it from one thread; it allocates. Sources: (5.13)-(5.19), (5.23), (5.24), (4.4).
#pragma once

#include <vector>

#include "estimator/fit/estimation.hpp"
#include "estimator/math/grid_reading.hpp"
#include "estimator/paper/optimisers/internal/problem.hpp"

namespace shaker::estimator::optimisers {

class PeriodicProblem final : public LeastSquaresProblem {
 public:
  // `model` must outlive it. Throws std::invalid_argument with an explanation for data that cannot
  // be used, also for runs that have only Fourier coefficients.
  PeriodicProblem(const Model& model, std::vector<RunData> runs,
                  EstimationOptions options = EstimationOptions{});

  int parameters() const override { return static_cast<int>(free_.size()); }
  int observations() const override { return observations_; }
  Eigen::VectorXd lower() const override;
  Eigen::VectorXd upper() const override;
  bool evaluate(const Eigen::VectorXd& theta, Eigen::VectorXd& e,
                Eigen::MatrixXd* jacobian) override;
  bool has_curvature() const override { return options_.grid.scheme != Scheme::fourier; }
  bool curvature(const Eigen::VectorXd& theta, Eigen::MatrixXd& q) override;

  // Convert all parameters of the model to the free ones, and back.
  Eigen::VectorXd reduce(const std::vector<double>& all) const;
  std::vector<double> expand(const Eigen::VectorXd& theta) const;

  long solutions() const { return solutions_; }  // number of periodic solutions computed
  void forget();                                 // discards solutions and count

 private:
  struct Run {
    RunData data;
    std::vector<double> scale;  // of each residual: sqrt of its relative inverse variance
    std::vector<GridReading> readings;
    AlignedVector good;  // the last solution
    bool warm = false;
  };
  void prepare(Run& run, int points);
  bool solve(const std::vector<double>& theta);
  bool add_curvature(std::size_t run, const std::vector<double>& theta, const double* e,
                     Eigen::MatrixXd& q);

  const Model& model_;
  EstimationOptions options_;
  std::vector<Run> runs_;
  std::vector<PeriodicSystem> systems_;
  std::vector<int> free_;
  std::vector<double> fixed_;      // all parameters; those that are not free keep these values
  std::vector<double> unchanged_;  // zeros: no change of theta
  int observations_ = 0;
  long solutions_ = 0;
};

}  // namespace shaker::estimator::optimisers
