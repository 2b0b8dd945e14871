#include "estimator/diagnosis/cycles/harmonics.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/math/harmonic_basis.hpp"
#include "estimator/math/numbers.hpp"
#include "estimator/math/simd_math.hpp"

namespace shaker::estimator::diagnosis {

Eigen::VectorXd derivative(const Eigen::VectorXd& harmonics, double frequency_hz) {
  Eigen::VectorXd rate = Eigen::VectorXd::Zero(harmonics.size());
  for (Eigen::Index c = 1; c + 1 < harmonics.size(); c += 2) {
    const double omega = kTwoPi * frequency_hz * harmonic_order(c);
    rate[c] = omega * harmonics[c + 1];
    rate[c + 1] = -omega * harmonics[c];
  }
  return rate;
}

Eigen::MatrixXd synthesis_matrix(int harmonics, int points) {
  Eigen::VectorXd cosine(points), sine(points);
  for (Eigen::Index i = 0; i < points; ++i) {
    cosine[i] = harmonic_term(1, static_cast<int>(i), points);
    sine[i] = harmonic_term(2, static_cast<int>(i), points);
  }
  Eigen::MatrixXd table(points, harmonic_size(harmonics));
  table.col(0).setOnes();
  for (Eigen::Index h = 1; h <= harmonics; ++h) {
    Eigen::Index turned = 0;  // h i, modulo points
    for (Eigen::Index i = 0; i < points; ++i) {
      table(i, 2 * h - 1) = cosine[turned];
      table(i, 2 * h) = sine[turned];
      turned += h;
      while (turned >= points)
        turned -= points;
    }
  }
  return table;
}

namespace {

// Points that are computed at a time, as each step needs the result of the last one.
constexpr int kAbreast = 16;

// Clenshaw's recurrence at angles of these cosines and sines.
SHAKER_SIMD_CLONES void sum_harmonics(Eigen::Index size, const double* harmonics,
                                      const double* __restrict cosine,
                                      const double* __restrict sine, double* __restrict sum) {
  double a[kAbreast] = {}, a_before[kAbreast] = {}, b[kAbreast] = {}, b_before[kAbreast] = {};
  for (Eigen::Index c = size - 2; c > 0; c -= 2) {
    for (int k = 0; k < kAbreast; ++k) {
      const double a_next = harmonics[c] + 2.0 * cosine[k] * a[k] - a_before[k];
      const double b_next = harmonics[c + 1] + 2.0 * cosine[k] * b[k] - b_before[k];
      a_before[k] = a[k];
      b_before[k] = b[k];
      a[k] = a_next;
      b[k] = b_next;
    }
  }
  for (int k = 0; k < kAbreast; ++k)
    sum[k] = harmonics[0] + cosine[k] * a[k] - a_before[k] + sine[k] * b[k];
}

}  // namespace

Eigen::VectorXd synthesised(const Eigen::VectorXd& harmonics, int points) {
  using Some = Eigen::Array<double, kAbreast, 1>;
  const double step = kTwoPi / points;
  const Some turns = step * Some::LinSpaced(0.0, kAbreast - 1.0);
  const Some turned_cosine = turns.cos(), turned_sine = turns.sin();
  Eigen::VectorXd curve(points);
  for (Eigen::Index i = 0; i < points; i += kAbreast) {
    const double c0 = std::cos(step * static_cast<double>(i));
    const double s0 = std::sin(step * static_cast<double>(i));
    const Some cosine = c0 * turned_cosine - s0 * turned_sine;
    const Some sine = s0 * turned_cosine + c0 * turned_sine;
    Some sum;
    sum_harmonics(harmonics.size(), harmonics.data(), cosine.data(), sine.data(), sum.data());
    const Eigen::Index count = std::min<Eigen::Index>(kAbreast, points - i);
    curve.segment(i, count) = sum.head(count).matrix();
  }
  return curve;
}

Eigen::MatrixXd analysis_matrix(int harmonics, int points) {
  Eigen::MatrixXd table = (2.0 / points) * synthesis_matrix(harmonics, points).transpose();
  table.row(0) *= 0.5;
  return table;
}

std::shared_ptr<const LeftFactor> AnalysisMatrices::get(int harmonics, int points) {
  auto& known = made_[{harmonics, points}];
  if (!known) known = std::make_shared<const LeftFactor>(analysis_matrix(harmonics, points));
  return known;
}

void shift_origin(Eigen::Ref<Eigen::VectorXd> harmonics, double turns) {
  for (Eigen::Index c = 1; c + 1 < harmonics.size(); c += 2) {
    const double turn = kTwoPi * harmonic_order(c) * turns;
    const double a = harmonics[c];
    const double b = harmonics[c + 1];
    harmonics[c] = a * std::cos(turn) + b * std::sin(turn);
    harmonics[c + 1] = b * std::cos(turn) - a * std::sin(turn);
  }
}

void low_pass(Eigen::Ref<Eigen::VectorXd> harmonics, double omega_lag) {
  for (Eigen::Index c = 1; c + 1 < harmonics.size(); c += 2) {
    const double wt = harmonic_order(c) * omega_lag;
    const double a = harmonics[c];
    const double b = harmonics[c + 1];
    harmonics[c] = (a - wt * b) / (1.0 + wt * wt);
    harmonics[c + 1] = (b + wt * a) / (1.0 + wt * wt);
  }
}

}  // namespace shaker::estimator::diagnosis
