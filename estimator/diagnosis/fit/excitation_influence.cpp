#include "estimator/diagnosis/fit/internal/excitation_influence.hpp"

#include <cmath>
#include <numbers>
#include <optional>

#include "estimator/diagnosis/records/internal/transient_cosines.hpp"
#include "estimator/diagnosis/records/internal/transient_load.hpp"
#include "estimator/diagnosis/records/internal/transient_seen.hpp"
#include "estimator/math/aligned.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/solve/time/state_equations.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// s' = A s + b x about each sample.
struct Linear {
  std::vector<MatrixXd> a;
  MatrixXd b;  // a row a sample
};

std::optional<Linear> linearised(const StateEquations& equations, const std::vector<double>& theta,
                                 const VectorXd& excitation, const MatrixXd& states) {
  const Index n = states.rows(), m = states.cols();
  const auto wide = static_cast<std::size_t>((n + 7) / 8 * 8);
  const auto count = static_cast<std::size_t>(m);
  AlignedVector store(wide * (count * (3 + count) + 1));
  std::vector<double*> s, rate, moved, h_s;
  double* next = store.data();
  const auto take = [&](std::vector<double*>& list, std::size_t arrays) {
    for (std::size_t k = 0; k < arrays; ++k, next += wide)
      list.push_back(next);
  };
  take(s, count);
  take(rate, count);
  take(moved, count);
  take(h_s, count * count);
  for (Index j = 0; j < m; ++j) {
    for (Index i = 0; i < static_cast<Index>(wide); ++i)
      s[static_cast<std::size_t>(j)][i] = states(std::min(i, n - 1), j);
  }
  for (Index i = 0; i < static_cast<Index>(wide); ++i)
    next[i] = excitation[std::min(i, n - 1)];
  StateEquations::Workspace work;
  const auto lanes = static_cast<int>(n);
  if (!equations.rates(lanes, s.data(), next, theta.data(), work, rate.data(), h_s.data(), nullptr))
    return std::nullopt;
  const double step = 1e-3 * std::max(excitation.cwiseAbs().maxCoeff(), 1e-12);
  for (std::size_t i = 0; i < wide; ++i)
    next[i] += step;
  if (!equations.rates(lanes, s.data(), next, theta.data(), work, moved.data(), nullptr, nullptr))
    return std::nullopt;
  Linear linear{{}, MatrixXd(n, m)};
  for (Index i = 0; i < n; ++i) {
    MatrixXd a(m, m);
    for (Index r = 0; r < m; ++r) {
      for (Index c = 0; c < m; ++c)
        a(r, c) = h_s[static_cast<std::size_t>(r * m + c)][i];
      const auto row = static_cast<std::size_t>(r);
      linear.b(i, r) = (moved[row][i] - rate[row][i]) / step;
    }
    linear.a.push_back(std::move(a));
  }
  return linear;
}

MatrixXd cosines(Index samples, Index count) {
  MatrixXd waves(samples, count);
  for (Index i = 0; i < samples; ++i) {
    const double angle =
        std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(samples);
    for (Index k = 0; k < count; ++k)
      waves(i, k) = std::cos(angle * static_cast<double>(k));
  }
  return waves;
}

}  // namespace

MatrixXd over_excitation(const Model& model, const std::vector<double>& theta,
                         const SampledRun& run, const MatrixXd& states, Index keep, Index count) {
  const StateEquations equations(model);
  const auto linear = linearised(equations, theta, run.excitation, states);
  if (!linear) return MatrixXd(keep, 0);
  const Index n = states.rows(), m = states.cols(), seen = model.observed();
  const MatrixXd waves = cosines(n, count);
  const MatrixXd one = MatrixXd::Identity(m, m);
  // The trapezium rule: stable however stiff a friction's memory is.
  SampledCourse curves{states.col(seen), MatrixXd::Zero(n, count + model.parameter_count())};
  const bool loaded = sees_load(model);
  const auto of_load =
      loaded ? transient_load(equations, theta, run.excitation, states) : std::nullopt;
  if (loaded && !of_load) return MatrixXd(keep, 0);
  SampledCourse load;
  if (of_load) load = {of_load->value, curves.slopes};
  MatrixXd s = MatrixXd::Zero(m, count);
  const double half = 0.5 * run.dt;
  for (Index i = 1; i < n; ++i) {
    const auto now = static_cast<std::size_t>(i);
    s = (one + half * linear->a[now - 1]) * s;
    s += half * linear->b.row(i - 1).transpose() * waves.row(i - 1);
    s += half * linear->b.row(i).transpose() * waves.row(i);
    s = solve_square(one - half * linear->a[now], s);
    curves.slopes.row(i).head(count) = s.row(seen);
    if (of_load) load.slopes.row(i).head(count) = of_load->over_states.row(i) * s;
  }
  observe_samples(model, theta, run, load, count, curves);
  return CosineTransform(n).analyse(curves.slopes.leftCols(count), keep);
}

}  // namespace shaker::estimator::diagnosis
