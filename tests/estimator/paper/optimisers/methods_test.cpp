#include "estimator/paper/optimisers/methods.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/estimator/paper/optimisers/standard_problems.hpp"

namespace shaker::estimator::optimisers {
namespace {

using namespace testing;

Eigen::VectorXd vector(std::initializer_list<double> values) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(values.size()));
  Eigen::Index k = 0;
  for (const double value : values)
    out[k++] = value;
  return out;
}

FormulaData jennrich_sampson_data() {
  std::vector<double> y;
  for (int i = 1; i <= 10; ++i)
    y.push_back(2.0 + 2.0 * i);
  return numbered(y);
}

FormulaData brown_dennis_data() {
  FormulaData data = numbered(std::vector<double>(20, 0.0));
  for (Extended& x : data.x)
    x /= 5;
  return data;
}

TEST(Methods, AreFoundByNameAndSayWhoseCodeTheyAre) {
  EXPECT_GE(methods().size(), 12U);
  for (const Method& method : methods()) {
    EXPECT_EQ(find_method(method.name), &method);
    EXPECT_FALSE(method.source.empty() || method.needs.empty() || method.equation.empty());
  }
  EXPECT_EQ(find_method("magic"), nullptr);
}

// Plain and under-relaxed Gauss-Newton need not converge for a large residual.
bool pure(const Method& method) {
  return method.name == "gauss_newton" || method.name == "gauss_newton_relaxed";
}

TEST(Methods, AllFindTheBananaOfRosenbrock) {
  for (const Method& method : methods()) {
    FormulaProblem<Rosenbrock> problem(numbered({0.0, 1.0}));
    const Summary found = method.minimise(problem, vector({-1.2, 1.0}), {});
    EXPECT_EQ(found.status, Status::converged) << method.name;
    EXPECT_NEAR(found.theta[0], 1.0, 1e-6) << method.name;
    EXPECT_NEAR(found.theta[1], 1.0, 1e-6) << method.name;
    EXPECT_GT(found.evaluations, 0) << method.name;
  }
}

TEST(Methods, AllButGaussNewtonSurviveTheLargeResidualsOfJennrichAndSampson) {
  for (const Method& method : methods()) {
    // A line search does not help Gauss-Newton where its direction is useless: J is
    // rank-deficient there.
    if (pure(method) || method.name == "gauss_newton_search") continue;
    FormulaProblem<JennrichSampson> problem(jennrich_sampson_data());
    const Summary found = method.minimise(problem, vector({0.3, 0.4}), {});
    EXPECT_EQ(found.status, Status::converged) << method.name;
    EXPECT_NEAR(found.theta[0], 0.2578, 5e-5) << method.name;
    EXPECT_NEAR(found.theta[1], 0.2578, 5e-5) << method.name;
    EXPECT_NEAR(found.sum_of_squares, 124.362, 5e-4) << method.name;
  }
}

TEST(Methods, AllButPureGaussNewtonSurviveTheLargeResidualsOfBrownAndDennis) {
  for (const Method& method : methods()) {
    if (pure(method)) continue;
    FormulaProblem<BrownDennis> problem(brown_dennis_data());
    Options options;
    options.max_iterations = 2000;
    const Summary found = method.minimise(problem, vector({25, 5, -5, -1}), options);
    EXPECT_EQ(found.status, Status::converged) << method.name;
    EXPECT_NEAR(found.sum_of_squares, 85822.2, 0.05) << method.name;
  }
}

// The second-order method needs a tenth of the steps of Gauss-Newton.
TEST(ModifiedGaussNewton, NeedsFarFewerStepsOnLargeResidualsThanGaussNewton) {
  FormulaProblem<BrownDennis> problem(brown_dennis_data());
  Options options;
  options.max_iterations = 2000;
  const auto start = vector({25, 5, -5, -1});
  const Summary plain = gauss_newton_search(problem, start, options);
  const Summary modified = modified_gauss_newton(problem, start, options);
  const Summary exact = newton(problem, start, options);
  ASSERT_EQ(modified.status, Status::converged);
  ASSERT_EQ(exact.status, Status::converged);
  EXPECT_LT(modified.iterations, 40);
  EXPECT_LT(exact.iterations, 40);
  EXPECT_GT(plain.iterations, 2 * modified.iterations);
}

TEST(ModifiedGaussNewton, SurvivesASingularJacobianAtTheMinimum) {
  for (const char* name : {"modified_gauss_newton", "levenberg_marquardt", "newton", "automatic"}) {
    FormulaProblem<PowellSingular> problem(numbered({0, 0, 0, 0}));
    const Summary found = find_method(name)->minimise(problem, vector({3, -1, 0, 1}), {});
    EXPECT_LT(found.sum_of_squares, 1e-18) << name;
  }
}

TEST(Methods, FindTheMinimumOfAProblemWithoutFullRank) {
  // MGH 33: y = 1, minimum m (m - 1) / (2 (2 m + 1)), m = 10, for any theta on a plane.
  FormulaProblem<RankOne> problem(numbered(std::vector<double>(10, 1.0)));
  for (const Method& method : methods()) {
    const Summary found = method.minimise(problem, vector({1, 1, 1}), {});
    EXPECT_EQ(found.status, Status::converged) << method.name;
    EXPECT_NEAR(found.sum_of_squares, 90.0 / 42.0, 1e-8) << method.name;
    EXPECT_NEAR(found.theta[0] + 2 * found.theta[1] + 3 * found.theta[2], 3.0 / 21.0, 1e-6)
        << method.name;
  }
}

TEST(Methods, FindWhatIsDeterminedInTheExampleSixOne) {
  std::vector<double> y;
  for (int i = 1; i <= 10; ++i)
    y.push_back(2.0 * std::exp(-0.3 * i));
  for (const Method& method : methods()) {
    FormulaProblem<ProductOnly> problem(numbered(y));
    const Summary found = method.minimise(problem, vector({1.5, 1.0, 0.2}), {});
    EXPECT_NEAR(found.theta[0], 2.0, 1e-5) << method.name;
    EXPECT_NEAR(found.theta[1] * found.theta[2], 0.3, 1e-6) << method.name;
  }
}

// Observations up to 0.95 of the wall. From a start at 0.9 of the way to the wall, the first
// steps go beyond it.
TEST(Methods, RefuseStepsBeyondTheWallOfTheGasSpring) {
  FormulaData data;
  for (int i = 1; i <= 12; ++i) {
    const double u = 0.05 * i;
    data.x.emplace_back(u);
    data.y.emplace_back(5.0 * std::pow(1.0 - 1.62 * u, -1.1));
  }
  int refused = 0;
  for (const Method& method : methods()) {
    FormulaProblem<GasForce> problem(data);
    const Summary found = method.minimise(problem, vector({30.0, 0.2, 3.0}), {});
    refused += found.refused;
    EXPECT_TRUE(found.theta.allFinite()) << method.name;
    EXPECT_LT(found.theta[1], 1.0 / 0.6) << method.name << ": beyond the wall";
    if (found.status == Status::converged) {
      EXPECT_NEAR(found.theta[1], 1.62, 1e-4) << method.name;
    }
    const Summary nowhere = method.minimise(problem, vector({5.0, 2.0, 1.0}), {});
    EXPECT_EQ(nowhere.status, Status::inadmissible) << method.name;
  }
  EXPECT_GT(refused, 0);
}

// A box around Rosenbrock's problem that excludes its minimum; the constrained minimum is at b1
// = 0.8.
class Boxed final : public LeastSquaresProblem {
 public:
  int parameters() const override { return 2; }
  int observations() const override { return 2; }
  Eigen::VectorXd lower() const override { return Eigen::Vector2d(-2.0, -2.0); }
  Eigen::VectorXd upper() const override { return Eigen::Vector2d(0.8, 2.0); }
  bool evaluate(const Eigen::VectorXd& theta, Eigen::VectorXd& e,
                Eigen::MatrixXd* jacobian) override {
    EXPECT_LE(theta[0], 0.8);
    EXPECT_GE(theta[1], -2.0);
    return inner_.evaluate(theta, e, jacobian);
  }

 private:
  FormulaProblem<Rosenbrock> inner_{numbered({0.0, 1.0})};
};

TEST(Methods, KeepTheirBounds) {
  for (const Method& method : methods()) {
    if (method.source == "Ceres" && method.needs == "gradient") continue;  // these have no bounds
    Boxed problem;
    const Summary found = method.minimise(problem, vector({-1.2, 1.0}), {});
    EXPECT_EQ(found.status, Status::converged) << method.name;
    EXPECT_NEAR(found.theta[0], 0.8, 1e-7) << method.name;
    EXPECT_NEAR(found.theta[1], 0.64, 1e-6) << method.name;
    EXPECT_TRUE(found.at_bound) << method.name;
  }
}

// a exp(-b t), with b in its bounds and a without any.
class Decay final : public LeastSquaresProblem {
 public:
  int parameters() const override { return 2; }
  int observations() const override { return 3; }
  Eigen::VectorXd lower() const override { return Eigen::Vector2d(-HUGE_VAL, 0.1); }
  Eigen::VectorXd upper() const override { return Eigen::Vector2d(HUGE_VAL, 1.0); }
  bool evaluate(const Eigen::VectorXd& theta, Eigen::VectorXd& e,
                Eigen::MatrixXd* jacobian) override {
    EXPECT_GE(theta[1], 0.1);
    EXPECT_LE(theta[1], 1.0);
    const Eigen::Vector3d t(0.0, 1.0, 2.0);
    const Eigen::Vector3d shape = (-theta[1] * t).array().exp();
    e = 2.0 * (-0.5 * t).array().exp() - theta[0] * shape.array();
    if (jacobian != nullptr) {
      jacobian->resize(3, 2);
      jacobian->col(0) = shape;
      jacobian->col(1) = -theta[0] * t.cwiseProduct(shape);
    }
    return true;
  }
};

TEST(Methods, BeginInsideTheBoundsFromAStartOutside) {
  for (const Method& method : methods()) {
    if (method.source == "Ceres") continue;  // it refuses such a start
    Decay problem;
    const Summary found = method.minimise(problem, vector({1.0, 5.0}), {});
    EXPECT_EQ(found.status, Status::converged) << method.name;
    EXPECT_NEAR(found.theta[0], 2.0, 1e-5) << method.name;
    EXPECT_NEAR(found.theta[1], 0.5, 1e-5) << method.name;
  }
}

TEST(Methods, RejectContradictoryBounds) {
  class Wrong final : public LeastSquaresProblem {
   public:
    int parameters() const override { return 1; }
    int observations() const override { return 1; }
    Eigen::VectorXd lower() const override { return Eigen::VectorXd::Constant(1, 2.0); }
    Eigen::VectorXd upper() const override { return Eigen::VectorXd::Constant(1, 1.0); }
    bool evaluate(const Eigen::VectorXd&, Eigen::VectorXd&, Eigen::MatrixXd*) override {
      return false;
    }
  };
  for (const Method& method : methods()) {
    Wrong problem;
    EXPECT_THROW(method.minimise(problem, Eigen::VectorXd::Ones(1), {}), std::invalid_argument)
        << method.name;
  }
}

TEST(SecondOrder, HasTheDerivativesOfAFormulaByHand) {
  using D = SecondOrder<double, 2>;
  const D a = D::parameter(0.7, 0), b = D::parameter(1.3, 1);
  const D f = exp(a * b) / (D(1.0) + atan(b)) + pow(a, b) * sin(a);
  const auto value = [](double p, double q) {
    return std::exp(p * q) / (1.0 + std::atan(q)) + std::pow(p, q) * std::sin(p);
  };
  const double h = 1e-4;
  EXPECT_NEAR(f.value, value(0.7, 1.3), 1e-15);
  EXPECT_NEAR(f.gradient[0], (value(0.7 + h, 1.3) - value(0.7 - h, 1.3)) / (2 * h), 1e-7);
  EXPECT_NEAR(f.gradient[1], (value(0.7, 1.3 + h) - value(0.7, 1.3 - h)) / (2 * h), 1e-7);
  EXPECT_NEAR(f.hessian[0],
              (value(0.7 + h, 1.3) - 2 * value(0.7, 1.3) + value(0.7 - h, 1.3)) / (h * h), 1e-6);
  EXPECT_NEAR(f.hessian[1],
              (value(0.7 + h, 1.3 + h) - value(0.7 + h, 1.3 - h) - value(0.7 - h, 1.3 + h) +
               value(0.7 - h, 1.3 - h)) /
                  (4 * h * h),
              1e-6);
  EXPECT_NEAR(f.hessian[2],
              (value(0.7, 1.3 + h) - 2 * value(0.7, 1.3) + value(0.7, 1.3 - h)) / (h * h), 1e-6);
}

}  // namespace
}  // namespace shaker::estimator::optimisers
