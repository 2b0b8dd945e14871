// Gauss-Newton and Levenberg-Marquardt for theta, initial states and gaps together.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/math/box_minimum.hpp"
#include "estimator/math/dense.hpp"
#include "estimator/time/transient_impl.hpp"

namespace shaker::estimator {
namespace {

constexpr double kGapWeight = 10.0;  // of a gap in the merit, relative to its segment's residuals
constexpr double kGapClosed = 1e-8;  // relative to the states' size
constexpr double kNearlyUndamped = 1e-5;
constexpr double kSmallest = 1e-10;  // singular value relative to the largest, for undamped steps
constexpr double kFirstLambda = 1e-4;
constexpr double kLastLambda = 1e12;
constexpr std::size_t kShorter[] = {40, 12};  // samples in a segment of further attempts
constexpr std::size_t kOneTrajectory = std::numeric_limits<std::size_t>::max();
constexpr double kLeastLambda = 1e-12;     // damping of directions that the data do not determine
constexpr double kAccuracy = 10.0;         // error of a CVODES trajectory, in relative tolerances
constexpr double kRounding = 1e-11;        // of runge_kutta4, whose result is a smooth function
constexpr double kOfStandardError = 1e-7;  // a step with a smaller effect is negligible

}  // namespace

IntegrationReport TransientEstimator::Impl::integrate() {
  return integration->run(arcs, fit.theta, true);
}

std::string TransientEstimator::Impl::where(const IntegrationReport& report) const {
  const std::size_t index = record_of[report.arc];
  const std::string& name = records[index].data.name;
  return fmt::format("{}: {}", name.empty() ? fmt::format("record {}", index + 1) : name,
                     report.sentence());
}

void TransientEstimator::Impl::linearise(double closing) {
  information.clear();
  sum_of_squares = gaps = 0.0;
  fit.largest_gap = 0.0;
  for (std::size_t index = 0; index < records.size(); ++index)
    linearise_record(index, closing);
  linearise_prior();
  information.finish();
  r = information.r();
  right = information.right();
}

// Linearises (5.8) along a record, with condensed states of the segments. The initial state of an
// arc changes by moves * step + closes. This closes the share `closing` of the gap between the end
// of an arc and the start of the next one.
void TransientEstimator::Impl::linearise_record(std::size_t index, double closing) {
  using Row = Eigen::Map<const Eigen::RowVectorXd>;
  const RecordState& record = records[index];
  const auto size = static_cast<Eigen::Index>(m);
  const auto parameters = static_cast<Eigen::Index>(free.size());
  const std::size_t columns = m + free.size();
  const auto seen = static_cast<std::size_t>(model.observed());
  const double root = std::sqrt(record.data.weight);
  Eigen::MatrixXd& first = moves[record.first_arc];
  first.setZero();
  for (std::size_t j = 0; j < m; ++j) {
    if (record.unknown[j] >= 0) first(static_cast<Eigen::Index>(j), record.unknown[j]) = 1.0;
  }
  closes[record.first_arc].setZero();
  const std::size_t end = record.first_arc + record.arcs;
  for (std::size_t a = record.first_arc; a < end; ++a) {
    const Arc& arc = arcs[a];
    const std::size_t nodes = arc.times.size() - (a + 1 < end ? 1 : 0);
    for (std::size_t i = a == record.first_arc ? record.offset : 0; i < nodes; ++i) {
      const double* sensitivity = &arc.sensitivities[(i * m + seen) * columns];
      const Row over_start(sensitivity, size);
      const double residual =
          record.data.displacement[first_node[a] + i - record.offset] - arc.states[i * m + seen];
      sum_of_squares += record.data.weight * residual * residual;
      auto row = information.row();
      row.head(moves[a].cols()) = root * (over_start * moves[a]);
      row.head(parameters) += root * Row(sensitivity + m, parameters);
      row[moves[a].cols()] = root * (residual - over_start.dot(closes[a]));
    }
    if (a + 1 == end) break;
    const std::size_t last = arc.times.size() - 1;
    using Matrix =
        Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
    const Matrix whole(&arc.sensitivities[last * m * columns], size,
                       static_cast<Eigen::Index>(columns));
    moves[a + 1].noalias() = whole.leftCols(size) * moves[a];
    moves[a + 1].leftCols(parameters) += whole.rightCols(parameters);
    closes[a + 1].noalias() = whole.leftCols(size) * closes[a];
    for (std::size_t j = 0; j < m; ++j) {
      const double gap = arc.states[last * m + j] - arcs[a + 1].start[j];
      closes[a + 1][static_cast<Eigen::Index>(j)] += closing * gap;
      const double relative = gap / record.scale[j];
      fit.largest_gap = std::max(fit.largest_gap, std::fabs(relative));
      gaps += kGapWeight * record.data.weight * static_cast<double>(nodes) *
              std::pow(relative * record.scale[seen], 2);
    }
  }
}

double TransientEstimator::Impl::merit() const {
  const double noise = options.prior ? options.prior->noise : 0.0;
  return sum_of_squares + gaps + noise * noise * fit.prior_sum;
}

void TransientEstimator::Impl::move(const Eigen::VectorXd& step) {
  for (std::size_t k = 0; k < free.size(); ++k)
    fit.theta[static_cast<std::size_t>(free[k])] += step[static_cast<Eigen::Index>(k)];
  for (std::size_t a = 0; a < arcs.size(); ++a) {
    const Eigen::VectorXd moved = moves[a] * step + closes[a];
    for (std::size_t j = 0; j < m; ++j)
      arcs[a].start[j] += moved[static_cast<Eigen::Index>(j)];
  }
}

double TransientEstimator::Impl::observations() const {
  double count = 0.0;
  for (const RecordState& record : records)
    count += static_cast<double>(record.data.t.size());
  return count;
}

// The integration error of the whole prediction. Smaller effects of a step cannot be judged.
double TransientEstimator::Impl::accuracy() const {
  double sum = 0.0;
  for (const RecordState& record : records) {
    for (const double y : record.data.displacement)
      sum += record.data.weight * y * y;
  }
  const bool fixed_steps = options.time.integrator == Integrator::runge_kutta4;
  return (fixed_steps ? kRounding : kAccuracy * options.time.relative_tolerance) * std::sqrt(sum);
}

double TransientEstimator::Impl::value(std::size_t unknown) const {
  if (unknown < free.size()) return fit.theta[static_cast<std::size_t>(free[unknown])];
  for (const RecordState& record : records) {
    for (std::size_t j = 0; j < m; ++j) {
      if (record.unknown[j] == static_cast<int>(unknown)) return arcs[record.first_arc].start[j];
    }
  }
  return 0.0;
}

bool TransientEstimator::Impl::small(const Eigen::VectorXd& step) const {
  if (fit.largest_gap > kGapClosed) return false;
  const double effect = (r * step).norm();
  if (effect <= kOfStandardError * std::sqrt(sum_of_squares / observations())) return true;
  if (effect <= accuracy()) return true;
  for (std::size_t k = 0; k < unknowns.size(); ++k) {
    const double size = std::max({std::fabs(value(k)), unknowns[k].scale, 1e-12});
    if (!(std::fabs(step[static_cast<Eigen::Index>(k)]) <= options.tolerance * size)) return false;
  }
  return true;
}

// (4.7), by singular values, without the directions that the data do not determine.
Eigen::VectorXd TransientEstimator::Impl::pure_step() const {
  Eigen::VectorXd scale = r.colwise().norm();
  for (double& s : scale)
    s = s > 0.0 ? 1.0 / s : 1.0;
  const SingularValues svd = singular_values_of(r * scale.asDiagonal());
  Eigen::VectorXd along = svd.u.transpose() * right;
  for (Eigen::Index k = 0; k < along.size(); ++k)
    along[k] = svd.values[k] > kSmallest * svd.values[0] ? along[k] / svd.values[k] : 0.0;
  return scale.asDiagonal() * (svd.v * along);
}

bool TransientEstimator::Impl::leaves_the_box(const Eigen::VectorXd& step) const {
  for (std::size_t k = 0; k < unknowns.size(); ++k) {
    const double target = value(k) + step[static_cast<Eigen::Index>(k)];
    if (target < unknowns[k].lower || target > unknowns[k].upper) return true;
  }
  return false;
}

// (4.8).
Eigen::VectorXd TransientEstimator::Impl::damped_step(double lambda) const {
  const auto q = static_cast<Eigen::Index>(unknowns.size());
  Eigen::MatrixXd damped(2 * q, q);
  damped.topRows(q) = r;
  damped.bottomRows(q) = (std::sqrt(lambda) * r.colwise().norm()).asDiagonal();
  Eigen::VectorXd wanted = Eigen::VectorXd::Zero(2 * q);
  wanted.head(q) = right;
  return least_squares(damped, wanted);
}

// (4.8) inside the bounds.
Eigen::VectorXd TransientEstimator::Impl::box_step(double lambda) const {
  const auto q = static_cast<Eigen::Index>(unknowns.size());
  Eigen::VectorXd scale = r.colwise().norm();
  for (double& s : scale)
    s = s > 0.0 ? s : 1.0;
  const Eigen::MatrixXd unit = r * scale.cwiseInverse().asDiagonal();
  Eigen::MatrixXd a = unit.transpose() * unit;
  a.diagonal().array() += lambda;
  Eigen::VectorXd lower(q), upper(q);
  for (Eigen::Index k = 0; k < q; ++k) {
    const auto at = static_cast<std::size_t>(k);
    lower[k] = unknowns[at].lower - value(at);
    upper[k] = unknowns[at].upper - value(at);
  }
  const Eigen::VectorXd step = box_minimum(a, unit.transpose() * right, scale.cwiseProduct(lower),
                                           scale.cwiseProduct(upper));
  return step.cwiseQuotient(scale).cwiseMax(lower).cwiseMin(upper);
}

// Limits the step so that it at most doubles a parameter, as in the periodic estimator.
void TransientEstimator::Impl::cap(Eigen::VectorXd& step, const std::vector<double>& start) const {
  double share = 1.0;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const auto at = static_cast<std::size_t>(free[k]);
    const double most = std::max(std::fabs(fit.theta[at]), std::fabs(start[at]));
    const double wanted = std::fabs(step[static_cast<Eigen::Index>(k)]);
    if (wanted * share > most && most > 0.0) share = most / wanted;
  }
  step *= share;
}

void TransientEstimator::Impl::keep_iterate() {
  if (!options.keep_iterates) return;
  std::vector<double> now = arcs[records[0].first_arc].start;
  now.insert(now.end(), fit.theta.begin(), fit.theta.end());
  fit.iterates.push_back(std::move(now));
}

void TransientEstimator::Impl::no_solution(const IntegrationReport& report) {
  fit.status = FitStatus::no_solution;
  fit.trouble = where(report);
}

std::vector<std::vector<double>> TransientEstimator::Impl::present_starts() const {
  std::vector<std::vector<double>> starts;
  for (const Arc& arc : arcs)
    starts.push_back(arc.start);
  return starts;
}

void TransientEstimator::Impl::restore(const std::vector<double>& theta,
                                       const std::vector<std::vector<double>>& starts) {
  fit.theta = theta;
  for (std::size_t a = 0; a < arcs.size(); ++a)
    arcs[a].start = starts[a];
}

void TransientEstimator::Impl::iterate(bool damped) {
  const std::vector<double> start = fit.theta;
  IntegrationReport report = integrate();
  if (!report.ok) return no_solution(report);
  double lambda = damped ? kFirstLambda : 0.0, grow = 2.0, closing = 1.0;
  int refused = 0;
  linearise(closing);
  for (int iteration = 1; iteration <= options.max_iterations; ++iteration) {
    fit.iterations = iteration;
    Eigen::VectorXd step = damped ? damped_step(lambda) : pure_step();
    if (leaves_the_box(step)) step = box_step(lambda);
    if (damped) cap(step, start);
    const double before = merit();
    const auto theta = fit.theta;
    const auto starts = present_starts();
    const bool done = (!damped || lambda <= kNearlyUndamped) && small(step);
    move(step);
    report = integrate();
    bool accepted = report.ok;
    if (accepted) {
      linearise(closing);
      const double unsure = accuracy();
      if (damped) accepted = merit() <= before + 2.0 * std::sqrt(before) * unsure + unsure * unsure;
    } else if (!damped) {
      return no_solution(report);
    }
    if (accepted) {
      keep_iterate();
      if (done) {
        fit.status = FitStatus::converged;
        return;
      }
      refused = 0;
      grow = 2.0;
      if (damped) lambda = std::max(lambda / 8.0, kLeastLambda);
      closing = 1.0;
      continue;
    }
    restore(theta, starts);
    if (integrate(); done || ++refused > 40) {
      linearise(1.0);
      fit.status = done ? FitStatus::converged : FitStatus::not_converged;
      break;
    }
    lambda *= grow;
    grow *= 2.0;
    closing = std::max(0.05, 0.5 * closing);
    linearise(closing);
    if (lambda > kLastLambda) break;
  }
  if (fit.status == FitStatus::converged) return;
  fit.status = FitStatus::not_converged;
  fit.trouble = fmt::format("no convergence in {} iterations", fit.iterations);
  if (fit.largest_gap > kGapClosed)
    fit.trouble += fmt::format("; the segments still do not meet, by {:.1e} of the motion's size",
                               fit.largest_gap);
}

const TransientFit& TransientEstimator::fit(const std::vector<double>& start) {
  Impl& impl = *impl_;
  TransientFit& fit = impl.fit;
  if (start.size() != fit.theta.size())
    throw std::invalid_argument(
        fmt::format("the start has {} parameters, the model {}", start.size(), fit.theta.size()));
  if (impl.options.method == Method::lifted)
    throw std::invalid_argument(
        "the method 'lifted' is for periodic runs; segments do its work on records");
  const bool damped = impl.options.method == Method::levenberg_marquardt;
  const auto attempt = [&](std::size_t segment) {
    fit.iterates.clear();
    fit.trouble.clear();
    fit.iterations = 0;
    fit.status = FitStatus::not_converged;
    impl.begin(start, segment);
    impl.iterate(damped);
    return fit.status == FitStatus::converged;
  };
  // If a trajectory cannot be integrated with the start's parameters, shorter segments that start
  // from the data are tried. If segments fail, one trajectory is tried.
  if (!attempt(impl.options.segment)) {
    const std::string first = fit.trouble;
    const bool cut = impl.arcs.size() > impl.records.size();
    bool done = !damped;
    for (const std::size_t shorter : kShorter) {
      if (!done && fit.iterations == 0) done = attempt(shorter);
    }
    if (!done && cut) done = attempt(kOneTrajectory);
    if (fit.status != FitStatus::converged) fit.trouble = first;
  }
  impl.finish();
  return fit;
}

}  // namespace shaker::estimator
