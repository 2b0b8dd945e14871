#include "estimator/diagnosis/records/internal/transient_load.hpp"

#include <algorithm>

#include "estimator/math/aligned.hpp"
#include "estimator/model/instrument/instrument.hpp"
#include "estimator/model/instrument/observation.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Arrays of one value a sample, as the model wants them: aligned, and padded with the last sample.
class Arrays {
 public:
  Arrays(Index samples, std::size_t arrays)
      : wide_(static_cast<std::size_t>((samples + 7) / 8 * 8)), store_(wide_ * arrays) {}

  std::vector<double*> take(int count) {
    std::vector<double*> arrays;
    for (int k = 0; k < count; ++k, taken_ += wide_)
      arrays.push_back(&store_[taken_]);
    return arrays;
  }
  void fill(double* array, const VectorXd& values) const {
    std::copy(values.begin(), values.end(), array);
    std::fill(array + values.size(), array + wide_, values[values.size() - 1]);
  }

 private:
  std::size_t wide_, taken_ = 0;
  AlignedVector store_;
};

// At `samples` states: the load, its derivatives over the motion, and those of the rates.
class LoadAtSamples {
 public:
  LoadAtSamples(const StateEquations& equations, Index samples)
      : equations_(equations),
        model_(equations.model()),
        n_(static_cast<int>(samples)),
        m_(equations.states()),
        c_(equations.coordinates()),
        p_(equations.parameters()),
        arrays_(samples, count()),
        s_(arrays_.take(m_)),
        rate_(arrays_.take(m_)),
        h_s_(arrays_.take(m_ * m_)),
        h_theta_(arrays_.take(m_ * p_)),
        none_(arrays_.take(c_)),
        over_u_(arrays_.take(c_)),
        over_v_(arrays_.take(c_)),
        over_a_(arrays_.take(c_)),
        over_theta_(arrays_.take(p_)),
        work_(arrays_.take(observation_arrays(model_))),
        y_(arrays_.take(1).front()),
        x_(arrays_.take(1).front()) {}

  bool at(const std::vector<double>& theta, const VectorXd& excitation, const MatrixXd& states) {
    for (int j = 0; j < m_; ++j)
      arrays_.fill(s_[static_cast<std::size_t>(j)], states.col(j));
    if (excitation.size() > 0) arrays_.fill(x_, excitation);
    StateEquations::Workspace rates;
    if (!equations_.rates(n_, s_.data(), x_, theta.data(), rates, rate_.data(), h_s_.data(),
                          h_theta_.data()))
      return false;
    std::vector<double*> u, v, a;
    for (int c = 0; c < c_; ++c) {
      const int speed = equations_.velocity_of(c);
      const auto at = static_cast<std::size_t>(c);
      u.push_back(s_[at]);
      v.push_back(speed < 0 ? rate_[at] : s_[static_cast<std::size_t>(speed)]);
      a.push_back(speed < 0 ? none_[at] : rate_[static_cast<std::size_t>(speed)]);
    }
    ModelPoints points;
    points.n = n_;
    points.u = u.data();
    points.v = v.data();
    points.a = a.data();
    points.x = x_;
    return observe_motion(model_, Quantity::damper_force, points, theta.data(),
                          {y_, over_u_.data(), over_v_.data(), over_a_.data(), over_theta_.data()},
                          work_.data());
  }

  TransientLoad load() const {
    TransientLoad load{column(y_), MatrixXd::Zero(n_, m_), MatrixXd(n_, p_)};
    for (int k = 0; k < p_; ++k)
      load.over_parameters.col(k) = column(over_theta_[static_cast<std::size_t>(k)]);
    for (int c = 0; c < c_; ++c) {
      const auto at = static_cast<std::size_t>(c);
      const int speed = equations_.velocity_of(c);
      load.over_states.col(c) += column(over_u_[at]);
      if (speed >= 0) load.over_states.col(speed) += column(over_v_[at]);
      // What follows from the states: an acceleration, or the rate of a memory.
      add_rate(speed < 0 ? c : speed, column(speed < 0 ? over_v_[at] : over_a_[at]), load);
    }
    return load;
  }

 private:
  std::size_t count() const {
    return static_cast<std::size_t>(2 * m_ + m_ * m_ + m_ * p_ + 4 * c_ + p_ + 2 +
                                    observation_arrays(model_));
  }
  Eigen::Map<const VectorXd> column(const double* array) const { return {array, n_}; }
  void add_rate(int state, const VectorXd& over, TransientLoad& load) const {
    if (over.isZero(0.0)) return;
    for (int j = 0; j < m_; ++j)
      load.over_states.col(j) +=
          over.cwiseProduct(column(h_s_[static_cast<std::size_t>(state * m_ + j)]));
    for (int k = 0; k < p_; ++k)
      load.over_parameters.col(k) +=
          over.cwiseProduct(column(h_theta_[static_cast<std::size_t>(state * p_ + k)]));
  }

  const StateEquations& equations_;
  const Model& model_;
  int n_, m_, c_, p_;
  Arrays arrays_;
  std::vector<double*> s_, rate_, h_s_, h_theta_, none_, over_u_, over_v_, over_a_, over_theta_,
      work_;
  double *y_, *x_;
};

}  // namespace

bool sees_load(const Model& model) {
  return std::ranges::any_of(model.instruments(), [](const Model::Term& term) {
    return term.effect->instrument()->sees_load();
  });
}

std::optional<TransientLoad> transient_load(const StateEquations& equations,
                                            const std::vector<double>& theta,
                                            const VectorXd& excitation, const MatrixXd& states) {
  LoadAtSamples samples(equations, states.rows());
  if (!samples.at(theta, excitation, states)) return std::nullopt;
  return samples.load();
}

}  // namespace shaker::estimator::diagnosis
