// A model on measured periods as a least-squares problem for every method of this folder: theta are
// the model's free parameters, e = sqrt(weight) (y - u(tau; theta)) with u the periodic solution.
//
// A theta without a periodic solution, or with one that reaches the wall of the gas spring, is
// inadmissible. Each solution starts at the last good one; where Newton's method does not get from
// there to here, from rest through the amplitude.
//
// Second derivatives by second-order sensitivities. With G(z, theta) = 0 the discretised equations,
// G_z z_k = -G_k (5.24), and differentiated once more
//     G_z z_kl = -(second derivative of g along w_k and w_l),   w_k = (u_k, v_k, a_k, e_k),
// point by point; one factorisation serves all pairs k, l. The second derivative of g along w_l is
// taken from the effects' exact slopes by fourth-order central differences (1e-11 relative): any
// effect in the catalogue has it. Exact for schemes of finite differences without the correction of
// kinks; with it, to the correction's own order; Fourier grids have none.
//
// One thread. Sources: (5.13)-(5.19), (5.23), (5.24), (4.4).
#pragma once

#include <vector>

#include "estimator/estimation.hpp"
#include "estimator/optimise/problem.hpp"

namespace shaker::estimator::optimise {

class PeriodicProblem final : public LeastSquaresProblem {
 public:
  // `model` must outlive it. Throws std::invalid_argument with a sentence for data that cannot be
  // used, also for runs given as Fourier coefficients only.
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

  // From the model's parameters to the free ones and back.
  Eigen::VectorXd reduce(const std::vector<double>& all) const;
  std::vector<double> expand(const Eigen::VectorXd& theta) const;

  long solutions() const { return solutions_; }  // periodic solutions that were asked for
  void forget();                                 // solutions and count: the next start is cold

 private:
  struct Reading {
    int base = 0, count = 1;
    double weight[6] = {1, 0, 0, 0, 0, 0};
  };
  struct Run {
    RunData data;
    std::vector<double> scale;  // of each residual: root of its relative inverse variance
    std::vector<Reading> readings;
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
  std::vector<double> fixed_;      // all parameters, for those that are not free
  std::vector<double> unchanged_;  // no change of theta
  int observations_ = 0;
  long solutions_ = 0;
};

}  // namespace shaker::estimator::optimise
