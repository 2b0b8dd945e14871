#include "estimator/online/change_watch.hpp"

#include <cmath>
#include <string_view>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "estimator/math/dense.hpp"

namespace shaker::estimator {

std::string ParameterChange::sentence() const {
  return fmt::format(
      "{} changed by {:+.3g} +- {:.2g} {} ({:+.2g} %) about cycle {} of run {}, seen at cycle {}: "
      "the "
      "damper is not what it was (it heats up, leaks, wears); estimates mix before and after",
      name, jump, standard_error, unit, 100.0 * jump / before, cycle, run + 1, seen_at);
}

namespace online {
namespace {

constexpr std::size_t kRemembered = 80;  // more than the detector looks back
// After this many cycles of a run, little is left of a transient that the steady-state gate
// missed.
constexpr long kYoung = 64;

}  // namespace

ChangeWatch::ChangeWatch(const Model& model, int grid_points, double false_alarms_per_cycle)
    : model_(&model),
      predictor_(model, grid_points),
      threshold_(glr_threshold(false_alarms_per_cycle, predictor_.parameters())),
      detector_(predictor_.parameters(), threshold_) {}

void ChangeWatch::reset() {
  run_ = -1;
  detector_.reset();
}

void ChangeWatch::begin_run(const MeasuredCycle& cycle, const std::vector<double>& theta) {
  run_ = cycle.run;
  reference_ = theta;
  detector_.reset();
  last_.clear();
  indices_.clear();
  squares_ = points_ = 0.0;
}

std::vector<ParameterChange> ChangeWatch::add(const MeasuredCycle& cycle,
                                              const std::vector<double>& theta) {
  if (cycle.run != run_) begin_run(cycle, theta);
  if (last_.size() == cycle.displacement.size()) {
    for (std::size_t i = 0; i < last_.size(); ++i) {
      const double d = cycle.displacement[i] - last_[i];
      squares_ += 0.5 * d * d;
    }
    points_ += static_cast<double>(last_.size());
  }
  last_ = cycle.displacement;
  Prediction at;
  const bool noisy_excitation = cycle.excitation_error > 0.0;
  if (!predictor_.predict(cycle, reference_, noisy_excitation, at)) return {};
  indices_.push_back(cycle.index);
  if (indices_.size() > kRemembered) indices_.pop_front();
  const Eigen::VectorXd e =
      Eigen::Map<const Eigen::VectorXd>(cycle.displacement.data(), at.displacement.size()) -
      at.displacement;
  Eigen::MatrixXd information = at.jacobian.transpose() * at.jacobian;
  Eigen::VectorXd score = at.jacobian.transpose() * e;
  if (points_ == 0.0) return {};  // the first cycle: the noise is not known yet
  const double variance = squares_ / points_;
  if (noisy_excitation) {
    // The error of the excitation moves all points of a cycle together. The score then has the
    // covariance C = s^2 L + error^2 S S^T and the information L C^-1 L instead of L / s^2.
    const double error = cycle.excitation_error * cycle.excitation_error;
    const Eigen::MatrixXd scatter =
        variance * information + error * at.excitation_score * at.excitation_score.transpose();
    const Ldlt solver(scatter);
    score = variance * information * solver.solve(score);
    information = (variance * information * solver.solve(information)).eval();
    information = (0.5 * (information + information.transpose())).eval();
  }
  if (!(variance > 0.0) || !score.allFinite() || !information.allFinite()) return {};
  const auto change = detector_.add(score, information, variance);
  if (!change) return {};
  std::vector<ParameterChange> said = {described(*change, cycle)};
  for (const Change& other : change->alternatives)
    said.push_back(described(other, cycle));
  return said;
}

ParameterChange ChangeWatch::described(const Change& change, const MeasuredCycle& cycle) const {
  const auto index =
      static_cast<std::size_t>(predictor_.free()[static_cast<std::size_t>(change.parameter)]);
  const ModelParameter& parameter = model_->parameters()[index];
  const std::size_t back = std::min(indices_.size(), static_cast<std::size_t>(change.cycles_ago));
  return {.name = parameter.name,
          .unit = parameter.unit,
          .run = cycle.run,
          .cycle = indices_[indices_.size() - back],
          .seen_at = cycle.index,
          .jump = change.jump,
          .standard_error = change.standard_error,
          .before = reference_[index],
          .statistic = change.statistic,
          .threshold = threshold_,
          .alone = change.alone};
}

namespace {

// Lists changes as ", theta2 by -0.1 m/s^2". `alone` selects those that alone explain the
// change, or the others. `lead` precedes the first of them.
std::string others(const std::vector<ParameterChange>& changes, bool alone, std::string_view lead) {
  std::string text;
  for (std::size_t i = 1; i < changes.size(); ++i) {
    const ParameterChange& other = changes[i];
    if (other.alone == alone)
      text += fmt::format("{}{} by {:+.3g} {}", text.empty() ? lead : ", ", other.name, other.jump,
                          other.unit);
  }
  return text;
}

std::string explanation(const std::vector<ParameterChange>& changes) {
  const std::string& name = changes.front().name;
  if (changes.front().alone)
    return fmt::format("; {} alone explains it{}", name,
                       others(changes, true, "; so far this would look alike: "));
  const std::string better =
      others(changes, true, fmt::format("; {} alone does not explain it, but this would: ", name));
  return (better.empty()
              ? "; no parameter alone explains it (several changed, the response has not "
                "settled since, or the model lacks what changed)"
              : better) +
         others(changes, false, "; an alarm by themselves would be: ");
}

}  // namespace

std::string sentence(const std::vector<ParameterChange>& changes) {
  if (changes.empty()) return {};
  std::string text = changes.front().sentence();
  text += explanation(changes);
  if (changes.front().cycle < kYoung)
    text +=
        "; so early in a run it may be the rest of a slow transient (less than 4 % a cycle passes "
        "for steady), which dies out where a change stays";
  return text;
}

}  // namespace online
}  // namespace shaker::estimator
