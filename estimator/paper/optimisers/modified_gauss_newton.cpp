// Modified Gauss-Newton with graded singular values, (4.10)-(4.18) with their errata, for large
// residuals and rank-deficient Jacobians.
//
// J = U [S; 0] V^T (4.10). The p1 dominant singular values give p_1 = S1^-1 e_1 (4.16) without
// second-order information. In the space V2 of the others
//     (S2^2 + V2^T Q V2) p_2 = S2 e_2 - V2^T Q V1 p_1                                        (4.17)
// with e_1, e_2 the parts of U^T e; p = V1 p_1 + V2 p_2 (4.18). Q V2 is exact if the problem has
// second derivatives; otherwise it comes from differences of the gradient along the columns of V2.
// p1 is l (plain Gauss-Newton) while phi decreases fast. When the decrease is slow, p1 is lowered
// to the next gap of the singular values. Columns of J are first scaled to unit length. This is our
// own code because no library has the method.
#include <algorithm>
#include <cmath>

#include <Eigen/SVD>

#include "estimator/math/dense.hpp"
#include "estimator/paper/optimisers/internal/descent.hpp"
#include "estimator/paper/optimisers/internal/hessian.hpp"
#include "estimator/paper/optimisers/methods.hpp"

namespace shaker::estimator::optimisers {
namespace {

constexpr double kSlow = 0.01;  // relative decrease of phi below which p1 is lowered
constexpr double kFast = 0.2;   // ... and above which p1 is l again
constexpr double kRank = 1e-10;
constexpr double kFlatCurvature = 1e-12;  // of sigma_1^2: smaller curvature is rounding
constexpr double kGap = 0.3;              // a smaller sigma_(i+1) / sigma_i ends a cluster

class Graded {
 public:
  explicit Graded(Evaluator& evaluator) : evaluator_(evaluator) {}

  bool operator()(const Local& local, Eigen::VectorXd& step) {
    const Eigen::MatrixXd& j = local.jacobian;
    const Eigen::Index l = j.cols();
    Eigen::VectorXd scale = j.colwise().norm();
    for (Eigen::Index k = 0; k < l; ++k)
      scale[k] = scale[k] > 0.0 ? 1.0 / scale[k] : 1.0;
    const SingularValues svd = singular_values_with_full_v(j * scale.asDiagonal());
    Eigen::VectorXd sigma = Eigen::VectorXd::Zero(l);
    sigma.head(svd.values.size()) = svd.values;
    Eigen::VectorXd projected = Eigen::VectorXd::Zero(l);  // U^T e
    projected.head(svd.u.cols()) = svd.u.transpose() * local.point.e;
    const Eigen::Index p1 = grade(sigma, local.progress);
    const Eigen::MatrixXd v = scale.asDiagonal() * svd.v;  // in units of theta
    const Eigen::VectorXd first = projected.head(p1).cwiseQuotient(sigma.head(p1));  // (4.16)
    step = v.leftCols(p1) * first;
    const Eigen::Index p2 = l - p1;
    if (p2 == 0) return true;

    Eigen::MatrixXd q_v2(l, p2);
    if (!curvature(local, v.rightCols(p2), q_v2)) return p1 > 0;
    const Eigen::MatrixXd v2_q = q_v2.transpose();  // Q is symmetric
    Eigen::MatrixXd left = v2_q * v.rightCols(p2);
    left = 0.5 * (left + left.transpose()).eval();
    left.diagonal() += sigma.tail(p2).cwiseAbs2();
    const Eigen::VectorXd right =
        sigma.tail(p2).cwiseProduct(projected.tail(p2)) - v2_q * step;  // (4.17)
    step += v.rightCols(p2) *
            downhill_solve_above(left, right, kFlatCurvature * sigma[0] * sigma[0]);  // (4.18)
    // The sum of both parts may not be a descent direction; the first part alone is.
    if ((j * step).dot(local.point.e) <= 0.0) step = v.leftCols(p1) * first;
    return step.norm() > 0.0;
  }

 private:
  // Returns p1, the number of dominant singular values, for this iteration.
  Eigen::Index grade(const Eigen::VectorXd& sigma, double progress) {
    const Eigen::Index l = sigma.size();
    if (grade_ < 0 || progress > kFast) grade_ = l;
    grade_ = std::min(grade_, l);  // fewer parameters may be free than before
    if (progress < kSlow && grade_ > 0) {
      --grade_;
      while (grade_ > 0 && sigma[grade_] > kGap * sigma[grade_ - 1])
        --grade_;
    }
    Eigen::Index p1 = grade_;
    while (p1 > 0 && !(sigma[p1 - 1] > kRank * sigma[0]))
      --p1;
    return p1;
  }

  bool curvature(const Local& local, const Eigen::MatrixXd& v2, Eigen::MatrixXd& out) {
    if (evaluator_.problem().has_curvature()) {
      Eigen::MatrixXd q;
      if (!evaluator_.curvature(local.point.theta, q)) return false;
      out = rows_and_columns(q, local.free) * v2;
      return true;
    }
    for (Eigen::Index k = 0; k < v2.cols(); ++k) {
      Eigen::VectorXd column;
      if (!curvature_along(evaluator_, local, v2.col(k), column)) return false;
      out.col(k) = column;
    }
    return true;
  }

  Evaluator& evaluator_;
  Eigen::Index grade_ = -1;
};

}  // namespace

Summary modified_gauss_newton(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                              const Options& options) {
  Evaluator evaluator(problem, options);
  return descend("modified_gauss_newton", evaluator, start, StepRule::length, Graded(evaluator),
                 problem.parameters());
}

}  // namespace shaker::estimator::optimisers
