#include "estimator/objectives/channels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "estimator/statistics.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kSmallestEigenvalue = 1e-14;  // of the information with unit diagonal
constexpr double kNearlyUndamped = 1e-5, kMostDamped = 1e10;
constexpr double kFlat = 1e-11;      // relative change of the objective that rounding can make
constexpr double kSmallPart = 3e-5;  // of a standard error
constexpr int kMostStages = 200;

std::size_t at(Index k) {
  return static_cast<std::size_t>(k);
}

// How one run's points are read off its grid: by Lagrange's formula on six neighbours, or exactly.
struct Reader {
  int base = 0, count = 1;
  double weight[6] = {1, 0, 0, 0, 0, 0};
};

Reader reader_at(double tau, int points) {
  Reader reader;
  const double where = (tau - std::floor(tau)) * points;
  const int first = static_cast<int>(std::floor(where)) - 2;
  reader.base = (first + points) % points;
  reader.count = 6;
  for (int k = 0; k < 6; ++k) {
    reader.weight[k] = 1.0;
    for (int l = 0; l < 6; ++l) {
      if (l != k) reader.weight[k] *= (where - (first + l)) / (k - l);
    }
  }
  return reader;
}

void check(const ChannelRun& run, std::size_t index, std::size_t channels) {
  const auto reject = [&](const std::string& why) {
    throw std::invalid_argument(fmt::format("run {}: {}", index + 1, why));
  };
  const auto finite = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  };
  if (!(run.frequency_hz > 0.0) || !std::isfinite(run.frequency_hz))
    reject(fmt::format("the frequency is {} Hz; it must be positive", run.frequency_hz));
  if (run.channels.size() != channels)
    reject(fmt::format("{} channels; {} are wanted", run.channels.size(), channels));
  const std::size_t count = run.channels.front().size();
  for (const auto& series : run.channels) {
    if (series.size() != count)
      reject(fmt::format("one channel has {} points, another {}; they must be measured together",
                         count, series.size()));
    if (!finite(series)) reject("a sample is missing or not finite; leave such points out");
  }
  if (count < 8) reject(fmt::format("{} points are too few; a period needs at least 8", count));
  if (!run.tau.empty() && (run.tau.size() != count || !finite(run.tau)))
    reject(fmt::format("{} times for {} points, or one that is not finite", run.tau.size(), count));
  if (!finite(run.excitation) || (run.excitation.empty() && !(std::fabs(run.amplitude) > 0.0)))
    reject("the excitation has no amplitude, or a sample that is not finite");
  if (!(run.cycles > 0.0)) reject("cycles must be positive");
  if (!run.scatter.empty() && run.scatter.size() != channels * channels)
    reject(fmt::format("the scatter has {} numbers; {} are wanted", run.scatter.size(),
                       channels * channels));
}

// Residuals and derivatives at one theta.
struct Look {
  std::vector<MatrixXd> e;  // of each run, points x channels, times sqrt(cycles)
  std::vector<MatrixXd> j;  // (points * channels) x free, row point * channels + channel
  MatrixXd moment;          // (3.12), scatter included
};

class Fitting {
 public:
  Fitting(const Model& model, std::span<const Quantity> quantities, std::vector<ChannelRun> runs,
          const ChannelOptions& options)
      : model_(model),
        options_(options),
        runs_(std::move(runs)),
        m_(static_cast<Index>(quantities.size())) {
    if (runs_.empty()) throw std::invalid_argument("there is no run to estimate from");
    if (quantities.empty()) throw std::invalid_argument("there is no channel to estimate from");
    for (int k = 0; k < model.parameter_count(); ++k) {
      if (!model.parameters()[static_cast<std::size_t>(k)].fixed) free_.push_back(k);
    }
    unchanged_.assign(static_cast<std::size_t>(model.parameter_count()), 0.0);
    systems_.reserve(runs_.size());
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      check(runs_[r], r, quantities.size());
      add_system(r, quantities);
    }
    if (options.noise != NoiseModel::known) return;
    if (options.known_covariance.size() != quantities.size() * quantities.size())
      throw std::invalid_argument(
          "weighted least squares need the covariance of the channels' noise");
    known_ = Eigen::Map<const MatrixXd>(options.known_covariance.data(), m_, m_);
    if (!(Eigen::LLT<MatrixXd>(known_).info() == Eigen::Success))
      throw std::invalid_argument("the covariance of the channels' noise is not positive definite");
  }

  ChannelFit run(const std::vector<double>& start) {
    ChannelFit out;
    Fit& fit = out.fit;
    fit.theta = start;
    fit.observations = std::lround(points_ * static_cast<double>(m_));
    fit.degrees_of_freedom = fit.observations - static_cast<long>(free_.size());
    out.fit.status = FitStatus::no_solution;
    if (!look(start, now_)) {
      fit.trouble = trouble_;
      finish_empty(fit);
      return out;
    }
    fit.status = FitStatus::not_converged;
    MatrixXd v = options_.noise == NoiseModel::known ? known_ : spread_of_data();
    if (options_.noise == NoiseModel::known) {
      minimise(fit, &v);
    } else if (options_.stagewise) {
      stages(fit, v, out.stages);
    } else {
      minimise(fit, nullptr);
    }
    finish(out);
    return out;
  }

 private:
  void add_system(std::size_t r, std::span<const Quantity> quantities) {
    const ChannelRun& run = runs_[r];
    const auto count = static_cast<int>(run.channels.front().size());
    GridOptions grid = options_.grid;
    if (run.tau.empty()) grid.points = count * ((grid.points + count - 1) / count);
    PeriodicSystem& system = systems_.emplace_back(model_, grid);
    system.set_channels(quantities);
    if (run.excitation.empty())
      system.set_excitation(run.frequency_hz, run.amplitude);
    else
      system.set_excitation(run.frequency_hz, run.excitation, options_.excitation_harmonics);
    auto& readers = readers_.emplace_back();
    for (int i = 0; i < count; ++i) {
      if (run.tau.empty()) {
        readers.push_back({i * (grid.points / count), 1, {1, 0, 0, 0, 0, 0}});
      } else {
        readers.push_back(reader_at(run.tau[static_cast<std::size_t>(i)], grid.points));
      }
    }
    points_ += count * (run.scatter.empty() ? 1.0 : run.cycles);
    good_.emplace_back();
  }

  bool solve(const std::vector<double>& theta) {
    for (std::size_t r = 0; r < systems_.size(); ++r) {
      PeriodicSystem& system = systems_[r];
      SolveReport report;
      report.status = SolveStatus::no_convergence;
      if (!good_[r].empty()) {
        std::copy(good_[r].begin(), good_[r].end(), system.state().begin());
        report = system.solve(theta);
      }
      if (report.status != SolveStatus::converged) report = system.solve_from_rest(theta);
      if (report.status != SolveStatus::converged) {
        trouble_ = fmt::format("run {}: {}", r + 1, report.sentence());
        return false;
      }
      system.advance(1.0, unchanged_);
      good_[r].assign(system.state().begin(), system.state().end());
    }
    return true;
  }

  bool look(const std::vector<double>& theta, Look& out) {
    if (!solve(theta)) return false;
    const auto q = static_cast<Index>(free_.size());
    out.e.resize(runs_.size());
    out.j.resize(runs_.size());
    out.moment = MatrixXd::Zero(m_, m_);
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      const ChannelRun& run = runs_[r];
      const auto n = static_cast<Index>(readers_[r].size());
      const double root = std::sqrt(run.cycles);
      out.e[r].setZero(n, m_);
      out.j[r].setZero(n * m_, q);
      for (Index i = 0; i < n; ++i) {
        const Reader& reader = readers_[r][at(i)];
        for (Index b = 0; b < m_; ++b) {
          double predicted = 0.0;
          for (int k = 0; k < reader.count; ++k) {
            const int point = (reader.base + k) % systems_[r].points();
            predicted += reader.weight[k] * systems_[r].observed(point, static_cast<int>(b));
            const auto row = systems_[r].observed_row(point, static_cast<int>(b));
            for (Index l = 0; l < q; ++l)
              out.j[r](i * m_ + b, l) +=
                  root * reader.weight[k] * row[1 + static_cast<std::size_t>(free_[at(l)])];
          }
          out.e[r](i, b) = root * (run.channels[at(b)][at(i)] - predicted);
        }
      }
      out.moment += out.e[r].transpose() * out.e[r];
      if (!run.scatter.empty())
        out.moment += Eigen::Map<const MatrixXd>(run.scatter.data(), m_, m_);
    }
    return out.moment.allFinite();
  }

  // What the data scatter about their own means: a V to begin the stages with.
  MatrixXd spread_of_data() const {
    VectorXd variance = VectorXd::Zero(m_);
    for (const ChannelRun& run : runs_) {
      for (Index b = 0; b < m_; ++b) {
        const auto& y = run.channels[at(b)];
        const Eigen::Map<const VectorXd> values(y.data(), static_cast<Index>(y.size()));
        variance[b] += (values.array() - values.mean()).square().mean();
      }
    }
    return variance.cwiseMax(1e-300).asDiagonal();
  }

  // V that maximises the likelihood, theta given.
  MatrixXd covariance(const MatrixXd& moment) const {
    MatrixXd v = moment / points_;
    if (options_.noise == NoiseModel::independent) v = VectorXd(v.diagonal()).asDiagonal();
    // Exact data leave nothing; a share of the signal far below rounding keeps V invertible.
    v.diagonal() += 1e-26 * spread_of_data().diagonal();
    return v;
  }

  double prior_sum(const std::vector<double>& theta) const {
    double sum = 0.0;
    for (const int k : free_) {
      const ModelParameter& p = model_.parameters()[static_cast<std::size_t>(k)];
      if (!p.prior_mean) continue;
      const double off =
          (theta[static_cast<std::size_t>(k)] - *p.prior_mean) / *p.prior_standard_deviation;
      sum += off * off;
    }
    return sum;
  }

  // -2 ln of likelihood and prior without constants; `v` null: with V eliminated.
  double objective(const Look& at_theta, const std::vector<double>& theta,
                   const MatrixXd* v) const {
    const double prior = prior_sum(theta);
    if (v != nullptr) return Eigen::LLT<MatrixXd>(*v).solve(at_theta.moment).trace() + prior;
    const Eigen::LLT<MatrixXd> factor(covariance(at_theta.moment));
    const MatrixXd l = factor.matrixL();
    return 2.0 * points_ * l.diagonal().array().log().sum() + prior;
  }

  // Information J^T V^-1 J and gradient J^T V^-1 e, priors included.
  void normal_equations(const std::vector<double>& theta, const MatrixXd& v, MatrixXd& gram,
                        VectorXd& gradient) const {
    const auto q = static_cast<Index>(free_.size());
    gram.setZero(q, q);
    gradient.setZero(q);
    const Eigen::LLT<MatrixXd> factor(v);
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      for (Index i = 0; i < now_.e[r].rows(); ++i) {
        const MatrixXd rows =
            factor.matrixL().solve(now_.j[r].middleRows(i * m_, m_).eval()).eval();
        const VectorXd e = factor.matrixL().solve(now_.e[r].row(i).transpose().eval()).eval();
        gram += rows.transpose() * rows;
        gradient += rows.transpose() * e;
      }
    }
    for (Index k = 0; k < q; ++k) {
      const auto all = static_cast<std::size_t>(free_[at(k)]);
      const ModelParameter& p = model_.parameters()[all];
      if (!p.prior_mean) continue;
      const double weight = 1.0 / (*p.prior_standard_deviation * *p.prior_standard_deviation);
      gram(k, k) += weight;
      gradient[k] += weight * (*p.prior_mean - theta[all]);
    }
  }

  // A damped step inside the box; parameters on a bound that are pushed outwards stay.
  VectorXd step(const std::vector<double>& theta, const MatrixXd& gram, const VectorXd& gradient,
                double lambda) const {
    const Index q = gradient.size();
    MatrixXd a = gram;
    VectorXd b = gradient;
    const VectorXd size = gram.diagonal().cwiseMax(1e-300);
    for (Index k = 0; k < q; ++k) {
      const ModelParameter& p = model_.parameters()[static_cast<std::size_t>(free_[at(k)])];
      const double value = theta[static_cast<std::size_t>(free_[at(k)])];
      a(k, k) += lambda * size[k];
      if ((value <= p.lower && gradient[k] < 0.0) || (value >= p.upper && gradient[k] > 0.0)) {
        a.row(k).setZero();
        a.col(k).setZero();
        a(k, k) = size[k];
        b[k] = 0.0;
      }
    }
    const VectorXd root = size.cwiseSqrt();
    const MatrixXd unit = root.cwiseInverse().asDiagonal() * a * root.cwiseInverse().asDiagonal();
    VectorXd out = unit.ldlt().solve(b.cwiseQuotient(root).eval()).cwiseQuotient(root);
    for (Index k = 0; k < q; ++k) {
      const auto all = static_cast<std::size_t>(free_[at(k)]);
      const ModelParameter& p = model_.parameters()[all];
      // No step more than doubles a parameter: far away the linearisation promises too much.
      const double most = std::max(std::fabs(theta[all]), 1e-3);
      out[k] =
          std::clamp(theta[all] + std::clamp(out[k], -most, most), p.lower, p.upper) - theta[all];
    }
    return out;
  }

  double relative(const std::vector<double>& theta, const VectorXd& change) const {
    double worst = 0.0;
    for (Index k = 0; k < change.size(); ++k)
      worst = std::max(
          worst, std::fabs(change[k]) /
                     std::max(std::fabs(theta[static_cast<std::size_t>(free_[at(k)])]), 1e-12));
    return worst;
  }

  // A change of theta in standard errors, by the information at the last step.
  double in_errors(const VectorXd& change) const {
    return std::sqrt(std::max(change.dot(information_ * change), 0.0));
  }

  // Levenberg-Marquardt from fit.theta; `fixed`: V stays as it is.
  void minimise(Fit& fit, const MatrixXd* fixed) {
    double lambda = 1e-4, value = objective(now_, fit.theta, fixed);
    int at_bottom = 0;
    fit.status = FitStatus::not_converged;
    MatrixXd gram;
    VectorXd gradient;
    for (int iteration = 0; iteration < options_.max_iterations; ++iteration) {
      ++fit.iterations;
      normal_equations(fit.theta, fixed != nullptr ? *fixed : covariance(now_.moment), gram,
                       gradient);
      information_ = gram;
      const VectorXd change = step(fit.theta, gram, gradient, lambda);
      const double size = relative(fit.theta, change);
      std::vector<double> next = fit.theta;
      for (Index k = 0; k < change.size(); ++k)
        next[static_cast<std::size_t>(free_[at(k)])] += change[k];
      Look there;
      const bool admissible = look(next, there);
      const double after = admissible ? objective(there, next, fixed) : 0.0;
      if (admissible && after <= value + kFlat * std::max(std::fabs(value), points_)) {
        std::swap(now_, there);
        fit.theta = std::move(next);
        value = after;
        const bool full = lambda <= kNearlyUndamped;
        lambda = std::max(lambda / 10.0, 1e-14);
        at_bottom = size <= 1e3 * options_.tolerance ? at_bottom + 1 : 0;
        if (full && (size <= options_.tolerance || at_bottom > 8)) {
          fit.status = FitStatus::converged;
          return;
        }
        continue;
      }
      // Worse by rounding alone: the whole step that is left is a small part of its own error.
      if (in_errors(step(fit.theta, gram, gradient, 0.0)) < kSmallPart) {
        fit.status = FitStatus::converged;
        return;
      }
      lambda = std::max(lambda, 1e-8) * 10.0;
      if (lambda > kMostDamped) break;
    }
    fit.trouble = fmt::format("no convergence in {} iterations", fit.iterations);
  }

  // theta for V, V for theta, until neither moves.
  void stages(Fit& fit, MatrixXd v, int& count) {
    for (count = 0; count < kMostStages; ++count) {
      const std::vector<double> before = fit.theta;
      minimise(fit, &v);
      if (fit.status != FitStatus::converged) return;
      VectorXd moved(static_cast<Index>(free_.size()));
      for (Index k = 0; k < moved.size(); ++k) {
        const auto all = static_cast<std::size_t>(free_[at(k)]);
        moved[k] = fit.theta[all] - before[all];
      }
      v = covariance(now_.moment);
      if (count > 0 && (relative(fit.theta, moved) <= 10.0 * options_.tolerance ||
                        in_errors(moved) < kSmallPart))
        return;
    }
    fit.status = FitStatus::not_converged;
    fit.trouble = fmt::format("the noise's covariance does not settle in {} stages", kMostStages);
  }

  void finish_empty(Fit& fit) const {
    const std::size_t p = fit.theta.size(), q = free_.size();
    fit.standard_error.assign(p, 0.0);
    fit.at_bound.assign(p, 0);
    fit.determined.assign(p, 1);
    fit.covariance.assign(q * q, kNaN);
    fit.lack_of_fit = kNaN;
    for (std::size_t k = 0; k < p; ++k) {
      const ModelParameter& parameter = model_.parameters()[k];
      fit.at_bound[k] =
          !parameter.fixed && (fit.theta[k] <= parameter.lower || fit.theta[k] >= parameter.upper);
    }
  }

  // Each channel loses the degrees of freedom that it spends on parameters: the trace of its own
  // information over all of it.
  MatrixXd corrected(const MatrixXd& v, const MatrixXd& inverse) const {
    VectorXd spent = VectorXd::Zero(m_);
    const MatrixXd weight = v.inverse();
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      for (Index i = 0; i < now_.e[r].rows(); ++i) {
        const MatrixXd rows = now_.j[r].middleRows(i * m_, m_);
        spent += (rows * inverse * rows.transpose() * weight).diagonal();
      }
    }
    const VectorXd factor = (points_ / (points_ - spent.array()).max(1e-9)).sqrt().matrix();
    return factor.asDiagonal() * v * factor.asDiagonal();
  }

  void finish(ChannelFit& out) {
    Fit& fit = out.fit;
    finish_empty(fit);
    const MatrixXd v = options_.noise == NoiseModel::known ? known_ : covariance(now_.moment);
    const Eigen::LLT<MatrixXd> factor(v);
    const MatrixXd l = factor.matrixL();
    out.log_likelihood =
        -0.5 *
        (points_ * static_cast<double>(m_) * std::log(2.0 * std::numbers::pi) +
         2.0 * points_ * l.diagonal().array().log().sum() + factor.solve(now_.moment).trace());
    out.likely_covariance.assign(v.data(), v.data() + v.size());
    out.noise_covariance = out.likely_covariance;
    fit.sum_of_squares = now_.moment(0, 0);
    fit.noise = std::sqrt(v(0, 0));
    const auto q = static_cast<Index>(free_.size());
    const bool known = options_.noise == NoiseModel::known;
    fit.interval_degrees = known ? std::numeric_limits<double>::infinity()
                                 : points_ * static_cast<double>(m_) - static_cast<double>(q);
    fit.quantile = fit.interval_degrees > 0.0
                       ? student_t_quantile(0.5 + 0.5 * options_.confidence, fit.interval_degrees)
                       : kNaN;
    if (known && fit.degrees_of_freedom > 0)
      fit.lack_of_fit = chi_squared_above(factor.solve(now_.moment).trace(),
                                          static_cast<double>(fit.degrees_of_freedom));
    if (q == 0) return;
    MatrixXd gram;
    VectorXd gradient;
    normal_equations(fit.theta, v, gram, gradient);
    MatrixXd inverse;
    if (!invert(gram, fit, inverse)) return;
    if (!known) {
      const MatrixXd better = corrected(v, inverse);
      out.noise_covariance.assign(better.data(), better.data() + better.size());
      fit.noise = std::sqrt(better(0, 0));
      normal_equations(fit.theta, better, gram, gradient);
      if (!invert(gram, fit, inverse)) return;
    }
    fit.covariance.assign(inverse.data(), inverse.data() + inverse.size());
    for (Index k = 0; k < q; ++k)
      fit.standard_error[static_cast<std::size_t>(free_[at(k)])] = std::sqrt(inverse(k, k));
  }

  // False, and the lost directions marked, when the information is singular.
  bool invert(const MatrixXd& gram, Fit& fit, MatrixXd& inverse) const {
    const VectorXd root = gram.diagonal().cwiseMax(0.0).cwiseSqrt();
    const VectorXd scale = (root.array() > 0.0).select(root, 1.0);
    const MatrixXd unit =
        scale.cwiseInverse().asDiagonal() * gram * scale.cwiseInverse().asDiagonal();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(unit);
    const VectorXd& values = eigen.eigenvalues();
    const double largest = values[values.size() - 1];
    fit.condition = std::sqrt(largest / std::max(values[0], 1e-300));
    bool good = true;
    for (Index i = 0; i < values.size() && values[i] <= kSmallestEigenvalue * largest; ++i) {
      good = false;
      std::vector<double> lost(fit.theta.size(), 0.0);
      for (Index k = 0; k < values.size(); ++k) {
        const double part = eigen.eigenvectors()(k, i);
        if (std::fabs(part) <= 0.05) continue;
        const auto all = static_cast<std::size_t>(free_[at(k)]);
        fit.determined[all] = 0;
        fit.standard_error[all] = kNaN;
        lost[all] = part / scale[k];
      }
      fit.lost.push_back(std::move(lost));
    }
    if (!good) {
      fit.status = FitStatus::undetermined;
      return false;
    }
    inverse = unit.ldlt().solve(MatrixXd::Identity(unit.rows(), unit.cols()));
    inverse = scale.cwiseInverse().asDiagonal() * inverse * scale.cwiseInverse().asDiagonal();
    return true;
  }

  const Model& model_;
  ChannelOptions options_;
  std::vector<ChannelRun> runs_;
  Index m_;
  std::vector<int> free_;
  std::vector<double> unchanged_;  // no change of theta
  std::vector<PeriodicSystem> systems_;
  std::vector<std::vector<Reader>> readers_;
  std::vector<AlignedVector> good_;  // last solutions
  double points_ = 0.0;              // of one channel, all cycles counted
  MatrixXd known_;
  MatrixXd information_;  // at the last step
  Look now_;
  std::string trouble_;
};

}  // namespace

ChannelFit fit_channels(const Model& model, std::span<const Quantity> quantities,
                        std::vector<ChannelRun> runs, const std::vector<double>& start,
                        const ChannelOptions& options) {
  if (start.size() != static_cast<std::size_t>(model.parameter_count()))
    throw std::invalid_argument(fmt::format("the start has {} parameters, the model {}",
                                            start.size(), model.parameter_count()));
  return Fitting(model, quantities, std::move(runs), options).run(start);
}

}  // namespace shaker::estimator
