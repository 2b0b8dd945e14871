// A least-squares problem from a formula y = f(b; x). The formula is written once and gives exact
// first and second derivatives, in double precision and in 34 digits.
//
// `Formula` is a struct with
//     static constexpr std::size_t kParameters;
//     template <class B, class X> B operator()(const B* b, const X* x) const;
// where B is a SecondOrder number and X its scalar. Functions such as `exp` and `log` are found by
// argument-dependent lookup.
#pragma once

#include <cmath>
#include <span>
#include <utility>

#include "estimator/paper/optimisers/internal/extended.hpp"
#include "estimator/paper/optimisers/internal/problem.hpp"
#include "estimator/paper/optimisers/internal/second_order.hpp"

namespace shaker::estimator::optimisers {

// Observations with all digits of the source. x has `predictors` values for each y.
struct FormulaData {
  int predictors = 1;
  std::vector<Extended> x, y;
};

template <class Formula>
class FormulaProblem final : public LeastSquaresProblem, public ExtendedProblem {
 public:
  static constexpr std::size_t kP = Formula::kParameters;

  explicit FormulaProblem(FormulaData data) : data_(std::move(data)) {
    for (const Extended& v : data_.x)
      x_.push_back(static_cast<double>(v));
    for (const Extended& v : data_.y)
      y_.push_back(static_cast<double>(v));
  }
  int parameters() const override { return static_cast<int>(kP); }
  int observations() const override { return static_cast<int>(y_.size()); }

  bool evaluate(const Eigen::VectorXd& theta, Eigen::VectorXd& e,
                Eigen::MatrixXd* jacobian) override {
    e.resize(observations());
    if (jacobian != nullptr) jacobian->resize(observations(), parameters());
    for (std::size_t i = 0; i < y_.size(); ++i) {
      const auto f = at<double>(theta.data(), &x_[i * stride()]);
      const auto row = static_cast<Eigen::Index>(i);
      e[row] = y_[i] - f.value;
      if (!std::isfinite(e[row])) return false;
      for (std::size_t k = 0; jacobian != nullptr && k < kP; ++k)
        (*jacobian)(row, static_cast<Eigen::Index>(k)) = f.gradient[k];
    }
    return true;
  }
  bool has_curvature() const override { return true; }
  bool curvature(const Eigen::VectorXd& theta, Eigen::MatrixXd& q) override {
    q.setZero(parameters(), parameters());
    for (std::size_t i = 0; i < y_.size(); ++i) {
      const auto f = at<double>(theta.data(), &x_[i * stride()]);
      std::size_t h = 0;
      for (Eigen::Index k = 0; k < parameters(); ++k) {
        for (Eigen::Index l = 0; l <= k; ++l, ++h)
          q(l, k) = q(k, l) -= (y_[i] - f.value) * f.hessian[h];
      }
    }
    return true;
  }
  const ExtendedProblem* extended() const override { return this; }
  bool products(const std::vector<Extended>& theta, ExtendedProducts& out) const override {
    out.sum = 0;
    out.downhill.assign(kP, Extended(0));
    out.gram.assign(kP * kP, Extended(0));
    out.q.assign(kP * kP, Extended(0));
    for (std::size_t i = 0; i < y_.size(); ++i) {
      const auto f = at<Extended>(theta.data(), &data_.x[i * stride()]);
      const Extended e = data_.y[i] - f.value;
      if (!isfinite(e)) return false;
      out.sum += e * e;
      std::size_t h = 0;
      for (std::size_t k = 0; k < kP; ++k) {
        out.downhill[k] += f.gradient[k] * e;
        for (std::size_t l = 0; l <= k; ++l, ++h) {
          out.gram[k * kP + l] += f.gradient[k] * f.gradient[l];
          out.q[k * kP + l] -= e * f.hessian[h];
          out.gram[l * kP + k] = out.gram[k * kP + l];
          out.q[l * kP + k] = out.q[k * kP + l];
        }
      }
    }
    return true;
  }

 private:
  std::size_t stride() const { return static_cast<std::size_t>(data_.predictors); }
  template <class T>
  static SecondOrder<T, kP> at(const T* theta, const T* x) {
    std::array<SecondOrder<T, kP>, kP> b;
    for (std::size_t k = 0; k < kP; ++k)
      b[k] = SecondOrder<T, kP>::parameter(theta[k], k);
    return Formula{}(b.data(), x);
  }

  FormulaData data_;
  std::vector<double> x_, y_;
};

}  // namespace shaker::estimator::optimisers
