#include "estimator/discrepancy/fit/prediction.hpp"

#include <algorithm>

#include "estimator/discrepancy/cycles/harmonics.hpp"
#include "estimator/discrepancy/fit/excitation_influence.hpp"
#include "estimator/discrepancy/records/transient_run.hpp"
#include "estimator/discrepancy/records/transient_seen.hpp"

namespace shaker::estimator::discrepancy {

using Eigen::Index;

namespace {
constexpr int kMostSteps = 12;       // of Newton's method from a solution nearby
constexpr double kTolerance = 1e-7;  // m/s^2, of the balance: Newton's next step is far below noise
constexpr int kMostFromRest = 600;   // what leads there takes a hundred
constexpr int kPatientSteps = 100;   // where the long way would be next
// Of the state. Where a velocity that sticks grazes zero, its kink comes and goes from step to
// step, and Newton's method stands still beside the solution; what is measured is not known to
// that.
constexpr double kBeside = 1e-7;

bool arrived(const SolveReport& report) {
  const bool beside = report.step_left > 0.0 && report.step_left < kBeside;
  return report.status == SolveStatus::converged || beside;
}
}  // namespace

Prediction::Prediction(const Model& model, const RunDatum& datum, int points)
    : model_(&model),
      points_(points),
      harmonics_(datum.harmonics()),
      sampled_(datum.sampled),
      to_limit_(datum.to_limit) {
  if (sampled_) {
    points_ = static_cast<int>(sampled_->samples());
    if (!datum.by_force) {
      transient_ = std::make_unique<TransientResponse>(model, datum);
      return;
    }
    check_instruments(model);
    const bool inertia = datum.kind == Kind::transient;
    march_ = std::make_unique<MotionMarch>(
        model, Motion{sampled_->dt, sampled_->u, sampled_->v, sampled_->a, sampled_->excitation},
        inertia);
    transform_ = std::make_unique<CosineTransform>(sampled_->samples());
    // What is missing from the balance is missing from the excitation.
    if (inertia) excitation_ = datum.response;
    return;
  }
  if (datum.kind == Kind::imposed_motion) {
    imposed_ = std::make_unique<ImposedMotion>(model, datum.frequency_hz, datum.driver, points);
    return;
  }
  response_ = std::make_unique<PeriodicSystem>(model, GridOptions{Scheme::order6, points, true});
  const auto orders = static_cast<int>((datum.driver.size() - 1) / 2);
  Eigen::VectorXd x = synthesis_matrix(orders, points) * datum.driver;
  x.array() -= datum.driver[0];
  response_->set_excitation_points(datum.frequency_hz,
                                   {x.data(), static_cast<std::size_t>(points)});
  if (datum.quantity != Quantity::displacement) response_->set_channels({&datum.quantity, 1});
  rows_.resize(points, 1 + model.parameter_count());
}

bool Prediction::solve(const std::vector<double>& theta, HowFar search) {
  // Damped steps towards sharp corners are many, and still a hundredth of those from rest.
  const int most = search == HowFar::near ? kMostSteps : kPatientSteps;
  if (is_at_) {
    follow(theta);
    if (arrived(response_->solve(theta, kMostSteps, kTolerance))) return true;
    go_to(kept_);
  }
  if (solved_ && arrived(response_->solve(theta, most, kTolerance))) return true;
  if (solved_ && search != HowFar::from_rest) return false;
  const SolveReport report = response_->solve_from_rest(theta, kTolerance, kMostFromRest);
  return arrived(report) && report.amplitude_reached >= 1.0;
}

bool Prediction::at_sampled(const std::vector<double>& theta) {
  if (transient_) {
    if (!transient_->at(theta)) return false;
    value_ = transient_->value();
    jacobian_ = transient_->jacobian();
    return true;
  }
  if (!march_->at(theta)) return false;
  Eigen::MatrixXd all(points_, 1 + march_->slope().cols());
  all << march_->force(), march_->slope();
  const Eigen::MatrixXd series = transform_->analyse(all, sampled_->keep);
  value_ = series.col(0);
  if (excitation_.size() > 0) value_ += excitation_;
  jacobian_ = series.rightCols(series.cols() - 1);
  return true;
}

// To where the sensitivities of the last solution lead: a Newton step less.
void Prediction::follow(const std::vector<double>& theta) {
  std::vector<double> change(theta.size());
  for (std::size_t k = 0; k < theta.size(); ++k)
    change[k] = theta[k] - at_[k];
  response_->advance(1.0, change);
}

void Prediction::go_to(const std::vector<double>& state) {
  response_->begin();
  std::copy(state.begin(), state.end(), response_->state().begin());
}

bool Prediction::at(const std::vector<double>& theta, HowFar search) {
  if (is_at_ && theta == at_) return true;
  is_at_ = on_grid(theta, search);
  if (!is_at_) return false;
  at_ = theta;
  if (!to_limit_) return true;
  value_ += to_limit_->value;
  for (std::size_t k = 0; k < theta.size(); ++k)
    value_ += (theta[k] - to_limit_->theta[k]) * to_limit_->slope.col(static_cast<Index>(k));
  jacobian_ += to_limit_->slope;
  return true;
}

bool Prediction::on_grid(const std::vector<double>& theta, HowFar search) {
  if (sampled_) return at_sampled(theta);
  if (imposed_) {
    if (!imposed_->at(theta)) return false;
    value_ = analysis() * imposed_->force();
    jacobian_ = analysis() * imposed_->slope();
    return true;
  }
  if (!solve(theta, search)) {
    if (!kept_.empty()) go_to(kept_);
    return false;
  }
  solved_ = true;
  kept_.assign(response_->state().begin(), response_->state().end());
  read();
  return true;
}

void Prediction::read() {
  for (int i = 0; i < points_; ++i) {
    rows_(i, 0) = response_->observed(i);
    const auto row = response_->observed_row(i);
    for (int k = 0; k < model_->parameter_count(); ++k)
      rows_(i, 1 + k) = row[static_cast<std::size_t>(1 + k)];
  }
  const Eigen::MatrixXd all = analysis() * rows_;
  value_ = all.col(0);
  jacobian_ = all.rightCols(all.cols() - 1);
}

Eigen::MatrixXd Prediction::over_excitation(int driver_harmonics) {
  std::vector<double> response;
  const int columns = 2 * driver_harmonics;
  if (!response_ || !response_->excitation_response(driver_harmonics, response))
    return Eigen::MatrixXd::Zero(value_.size(), columns);
  const int s = model_->coordinates();
  Eigen::MatrixXd curves(points_, columns);
  for (Index i = 0; i < points_; ++i) {
    for (Index k = 0; k < columns; ++k)
      curves(i, k) = response[static_cast<std::size_t>((i * s + model_->observed()) * columns + k)];
  }
  return analysis() * curves;
}

Eigen::MatrixXd Prediction::over_record(const std::vector<double>& theta, Index count) const {
  if (!transient_ || sampled_->excitation.size() == 0) return Eigen::MatrixXd(value_.size(), 0);
  return discrepancy::over_excitation(*model_, theta, *sampled_, transient_->states(),
                                      value_.size(), count);
}

Eigen::MatrixXd Prediction::over_motion() {
  return imposed_ ? Eigen::MatrixXd(analysis() * imposed_->over_motion()) : Eigen::MatrixXd();
}

const Eigen::MatrixXd& Prediction::analysis() {
  if (!analysis_)
    analysis_ = std::make_shared<const Eigen::MatrixXd>(analysis_matrix(harmonics_, points_));
  return *analysis_;
}

bool Prediction::alike(const Prediction& other) const {
  return !sampled_ && other.points_ == points_ && other.harmonics_ == harmonics_;
}

void Prediction::share(Prediction& other) {
  if (!alike(other) || analysis_) return;
  other.analysis();
  analysis_ = other.analysis_;
}

void Prediction::hold() {
  held_ = kept_;
}

void Prediction::go_back() {
  is_at_ = false;
  if (response_ && !held_.empty()) go_to(held_);
}

void Prediction::start_beyond(const Prediction& finer, const Prediction& coarser) {
  if (!response_) return;
  start_from(coarser);
  const std::vector<double> before(response_->state().begin(), response_->state().end());
  start_from(finer);
  for (std::size_t i = 0; i < before.size(); ++i)
    response_->state()[i] += 0.5 * (response_->state()[i] - before[i]);
}

void Prediction::start_from(const Prediction& other) {
  is_at_ = false;
  if (alike(other) && other.analysis_) analysis_ = other.analysis_;
  if (transient_ && other.transient_) transient_->start_from(*other.transient_);
  if (!response_ || !other.response_) return;
  const int n = points_, m = other.points_;
  const auto from = other.response_->state();
  const auto to = response_->state();
  const int mine = model_->coordinates();
  const int theirs = other.model_->coordinates();
  for (int c = 0; c < mine; ++c) {
    int shared = 0;
    while (shared < theirs && other.model_->coordinate_name(shared) != model_->coordinate_name(c))
      ++shared;
    for (int i = 0; i < n; ++i) {
      double& value = to[static_cast<std::size_t>(i * mine + c)];
      value = model_->rest(c);
      if (shared == theirs) continue;
      // Cubic through the four points about it.
      const double at = static_cast<double>(i) * m / n;
      const int j = static_cast<int>(at);
      const double t = at - j;
      const double weights[4] = {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2,
                                 -(t + 1) * t * (t - 2) / 2, (t + 1) * t * (t - 1) / 6};
      value = 0.0;
      for (int k = 0; k < 4; ++k)
        value += weights[k] * from[static_cast<std::size_t>((j - 1 + k + m) % m * theirs + shared)];
    }
  }
  solved_ = other.solved_;
}

}  // namespace shaker::estimator::discrepancy
