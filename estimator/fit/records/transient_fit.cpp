// Gauss-Newton and Levenberg-Marquardt for theta, initial states and gaps together.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/fit/records/internal/transient_impl.hpp"
#include "estimator/math/box_minimum.hpp"
#include "estimator/math/damped_minimum.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

constexpr double kGapClosed = 1e-8;  // relative to the states' size
constexpr double kNearlyUndamped = 1e-5;
constexpr double kSmallest = 1e-10;    // singular value relative to the largest, for undamped steps
constexpr double kFirstLambda = 1e-4;  // of a search that begins far from the solution
constexpr double kLastLambda = 1e12;
constexpr int kMaxRefused = 40;
constexpr std::size_t kShorter[] = {40, 12};  // samples in a segment of further attempts
// Far from the solution a sample in eight says what a step needs, and reversals need no cut.
constexpr std::size_t kCoarse = 8, kMedium = 4;
constexpr std::size_t kFewestCoarse = 2000;  // samples of all records, for which that pays
constexpr int kApproach = 15;                // iterations
constexpr double kNear = 3e-2;               // last step of a parameter of that approach, relative
constexpr std::size_t kOneTrajectory = std::numeric_limits<std::size_t>::max();
constexpr double kLeastLambda = 1e-12;     // damping of directions that the data do not determine
constexpr double kAccuracy = 10.0;         // error of a CVODES trajectory, in relative tolerances
constexpr double kRounding = 1e-11;        // of runge_kutta4, whose result is a smooth function
constexpr double kOfStandardError = 1e-7;  // a step with a smaller effect is negligible

// Refused steps raise the damping faster and faster.
struct TransientDamping {
  double lambda, grow = 2.0;
  int refused = 0;  // in turn

  bool raise_after_invalid_step() { return raise_after_failure(); }
  bool raise_after_failure() {
    lambda = std::max(lambda, 0.1 * kFirstLambda) * grow;
    grow *= 2.0;
    return ++refused <= kMaxRefused && lambda <= kLastLambda;
  }
  void lower_after_success() {
    refused = 0;
    grow = 2.0;
    lambda = std::max(lambda / 8.0, kLeastLambda);
  }
};

}  // namespace

std::string TransientEstimator::Impl::where(const IntegrationReport& report) const {
  const std::size_t index = record_of[report.arc];
  const std::string& name = records[index].data.name;
  return fmt::format("{}: {}", name.empty() ? fmt::format("record {}", index + 1) : name,
                     report.sentence());
}

double TransientEstimator::Impl::merit() const {
  const double noise = options.prior ? options.prior->noise : 0.0;
  return sum_of_squares + gaps + noise * noise * fit.prior_sum;
}

void TransientEstimator::Impl::move(const Eigen::VectorXd& step) {
  kept = false;
  for (std::size_t k = 0; k < free.size(); ++k)
    fit.theta[static_cast<std::size_t>(free[k])] += step[static_cast<Eigen::Index>(k)];
  const std::size_t columns = m + free.size();
  Eigen::VectorXd own(static_cast<Eigen::Index>(columns + 1));
  for (std::size_t index = 0; index < records.size(); ++index) {
    const RecordState& record = records[index];
    for (std::size_t c = 0; c < columns; ++c) {
      const int unknown = unknown_of(record, c);
      own[static_cast<Eigen::Index>(c)] = unknown >= 0 ? step[unknown] : 0.0;
    }
    own[static_cast<Eigen::Index>(columns)] = -1.0;
    move_starts(std::span(arcs).subspan(record.first_arc, record.arcs),
                shooting[index].moves() * own);
  }
}

// The integration error of the whole prediction. Smaller effects of a step cannot be judged.
double TransientEstimator::Impl::accuracy() const {
  const bool fixed_steps = options.time.integrator == Integrator::runge_kutta4;
  return (fixed_steps ? kRounding : kAccuracy * options.time.relative_tolerance) *
         std::sqrt(data_size);
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
  if (fit.largest_gap > std::min(kGapClosed, options.tolerance)) return false;
  const double effect = (r * step).norm();
  if (effect <= kOfStandardError * std::sqrt(sum_of_squares / observations)) return true;
  return effect <= accuracy() || relative_size(step) <= options.tolerance;
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
  Eigen::VectorXd lower(q), upper(q);
  for (Eigen::Index k = 0; k < q; ++k) {
    const auto at = static_cast<std::size_t>(k);
    lower[k] = unknowns[at].lower - value(at);
    upper[k] = unknowns[at].upper - value(at);
  }
  return damped_box_step(r.transpose() * r, r.transpose() * right, lower, upper, lambda);
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

double TransientEstimator::Impl::relative_size(const Eigen::VectorXd& step) const {
  double largest = 0.0;
  for (std::size_t k = 0; k < unknowns.size(); ++k) {
    const double size = std::max({std::fabs(value(k)), unknowns[k].scale, 1e-12});
    largest = std::max(largest, std::fabs(step[static_cast<Eigen::Index>(k)]) / size);
  }
  return largest;
}

// Whether `step` is the last one. After a full step, the next one and the gaps left go with its
// square, as the steps before have shown.
bool TransientEstimator::Impl::enough(const Level& level, const Eigen::VectorXd& step) const {
  const double size = relative_size(step);
  if (!level.last) return size <= level.enough;
  return small(step) || (shrinking.step * size * size < options.tolerance &&
                         shrinking.gap * size * size < std::min(kGapClosed, options.tolerance));
}

Eigen::VectorXd TransientEstimator::Impl::step_of(double lambda,
                                                  const std::vector<double>& start) const {
  Eigen::VectorXd step = lambda > 0.0 ? damped_step(lambda) : pure_step();
  if (leaves_the_box(step)) step = box_step(lambda);
  if (options.method == Method::levenberg_marquardt) cap(step, start);
  return step;
}

// Makes the last step. What it does to the squares is known without another integration.
void TransientEstimator::Impl::end(const Eigen::VectorXd& step) {
  const double size = relative_size(step);
  fit.largest_gap = std::min(fit.largest_gap, shrinking.gap * size * size);
  move(step);
  keep_iterate();
  const double noise = options.prior ? options.prior->noise : 0.0;
  prior_rows();
  sum_of_squares =
      std::max(0.0, closed_squares - right.squaredNorm() + (right - r * step).squaredNorm() -
                        noise * noise * fit.prior_sum);
}

// What the loop asks: math/damped_minimum.hpp.
struct TransientEstimator::Impl::Minimisation {
  Impl& impl;
  const Level& level;
  bool damped;
  std::vector<double> first;        // parameters at the start
  double lambda = 0.0;              // of the present step
  double size = 0.0, before = 0.0;  // of that step, relative; the merit before it
  double full_size = 0.0;           // of a full step just made; 0: it was not full
  double closing = 1.0;             // share of the gaps that a step closes
  Eigen::VectorXd step = {};

  bool compute_step(double with) {
    lambda = with;
    ++impl.fit.iterations;
    step = impl.step_of(lambda, first);
    before = impl.merit();
    size = impl.relative_size(step);
    if (full_size > 0.0)
      impl.shrinking = {size / (full_size * full_size),
                        impl.fit.largest_gap / (full_size * full_size)};
    return true;
  }

  bool converged_before_step() {
    if (damped && lambda > kNearlyUndamped && level.last) return false;
    if (!impl.enough(level, step)) return false;
    impl.end(step);
    return true;
  }

  bool step_is_successful() {
    const auto theta = impl.fit.theta;
    const auto starts = impl.present_starts();
    std::swap(impl.sums, impl.sums_before);
    impl.move(step);
    const IntegrationReport report = impl.integrate(level);
    if (!report.ok && !damped) {
      impl.no_solution(report);
      return false;
    }
    if (report.ok) impl.linearise(closing);
    const double unsure = impl.accuracy();
    if (report.ok &&
        (!damped || impl.merit() <= before + 2.0 * std::sqrt(before) * unsure + unsure * unsure)) {
      impl.keep_iterate();
      full_size = lambda <= kLeastLambda && closing == 1.0 ? size : 0.0;
      closing = 1.0;
      return true;
    }
    impl.restore(theta, starts);
    std::swap(impl.sums, impl.sums_before);
    impl.kept = false;
    closing = std::max(0.05, 0.5 * closing);
    impl.linearise(closing);
    return false;
  }

  bool converged_after_success() const { return false; }
  bool converged_after_failure() const { return false; }
};

bool TransientEstimator::Impl::iterate(const Level& level, double lambda) {
  const IntegrationReport report = integrate(level);
  if (!report.ok) {
    no_solution(report);
    return false;
  }
  Minimisation steps{*this, level, lambda > 0.0, fit.theta};
  linearise(steps.closing);
  TransientDamping damping{lambda};
  NoDamping none;
  const LoopEnd end = lambda > 0.0 ? minimise_damped(steps, damping, level.most)
                                   : minimise_damped(steps, none, level.most);
  return end == LoopEnd::converged;
}

// The approach of records in segments, from the data's starts: full steps, which mostly do best, and
// damped ones where those fail; then a step on all samples.
bool TransientEstimator::Impl::approach(const std::vector<double>& start, std::size_t segment) {
  const bool even = std::all_of(records.begin(), records.end(),
                                [](const RecordState& record) { return record.step > 0.0; });
  const bool whole = std::all_of(records.begin(), records.end(), [&](const RecordState& record) {
    return (arcs[record.first_arc].times.size() - 1) % kCoarse == 0;
  });
  const bool coarse = even && whole && integration->strides() && observations >= kFewestCoarse;
  for (const double lambda : {0.0, kFirstLambda}) {
    const Level far{{coarse ? kCoarse : 1, false, false}, kApproach, kNear, false};
    if (iterate(far, lambda)) {
      if (!coarse || iterate({{kMedium, true, false}, 1, 1e300, false}, 0.0)) return true;
    }
    begin(start, segment);
  }
  return false;
}

bool TransientEstimator::Impl::attempt(const std::vector<double>& start, std::size_t segment) {
  const bool damped = options.method == Method::levenberg_marquardt;
  fit.iterates.clear();
  fit.trouble.clear();
  begin(start, segment);
  const bool near = damped && arcs.size() > records.size() && approach(start, segment);
  const Level level{{}, options.max_iterations, 0.0, true};
  bool done = iterate(level, !damped ? 0.0 : near ? kLeastLambda : kFirstLambda);
  if (!done && near) {
    begin(start, segment);
    done = iterate(level, kFirstLambda);
  }
  if (done) {
    fit.status = FitStatus::converged;
    fit.trouble.clear();
  }
  if (done || fit.status == FitStatus::no_solution) return done;
  fit.trouble = fmt::format("no convergence in {} iterations", fit.iterations);
  if (fit.largest_gap > kGapClosed)
    fit.trouble += fmt::format("; the segments still do not meet, by {:.1e} of the motion's size",
                               fit.largest_gap);
  return false;
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
  // Segments of another length than asked for are tried if those fail; shorter ones, that start from
  // the data, if a trajectory cannot be integrated with the start's parameters; then one trajectory.
  if (!impl.attempt(start, impl.options.segment)) {
    const std::string first = fit.trouble;
    const bool cut = impl.arcs.size() > impl.records.size();
    bool done = impl.options.method != Method::levenberg_marquardt;
    if (!done && cut && impl.options.segment != 0) done = impl.attempt(start, 0);
    for (const std::size_t shorter : kShorter) {
      if (!done && fit.iterations == 0) done = impl.attempt(start, shorter);
    }
    if (!done && cut) done = impl.attempt(start, kOneTrajectory);
    if (fit.status != FitStatus::converged) fit.trouble = first;
  }
  impl.finish();
  return fit;
}

}  // namespace shaker::estimator
