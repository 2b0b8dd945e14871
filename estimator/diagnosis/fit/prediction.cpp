#include "estimator/diagnosis/fit/internal/prediction.hpp"

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/internal/excitation_influence.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"

namespace shaker::estimator::diagnosis {

using Eigen::Index;

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
    const bool inertia = datum.kind == Kind::transient;
    integrator_ = std::make_unique<MotionIntegrator>(
        model, Motion{sampled_->dt, sampled_->u, sampled_->v, sampled_->a, sampled_->excitation},
        inertia);
    integrator_->spend(datum.budget);
    transform_ = std::make_unique<CosineTransform>(sampled_->samples());
    // What is missing from the balance is missing from the excitation.
    if (inertia) excitation_ = datum.response;
    return;
  }
  if (datum.kind == Kind::imposed_motion) {
    imposed_ = std::make_unique<ImposedMotion>(model, datum.frequency_hz, datum.driver, points);
    return;
  }
  response_ = std::make_shared<PeriodicResponse>(model, datum, points);
  channel_ = response_->look_at(datum.quantity);
}

Prediction::Prediction(Prediction& of, const RunDatum& datum)
    : model_(of.model_),
      points_(of.points_),
      harmonics_(datum.harmonics()),
      response_(of.response_),
      channel_(response_->look_at(datum.quantity)),
      follows_(true),
      to_limit_(datum.to_limit) {}

bool Prediction::at_sampled(const std::vector<double>& theta) {
  if (transient_) {
    if (!transient_->at(theta)) return false;
    value_ = transient_->value();
    jacobian_ = transient_->jacobian();
    return true;
  }
  if (!integrator_->at(theta)) return false;
  Eigen::MatrixXd all(points_, 1 + integrator_->slope().cols());
  all << integrator_->force(), integrator_->slope();
  const Eigen::MatrixXd series = transform_->analyse(all, sampled_->keep);
  value_ = series.col(0);
  if (excitation_.size() > 0) value_ += excitation_;
  jacobian_ = series.rightCols(series.cols() - 1);
  return true;
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
    value_ = analysis().matrix() * imposed_->force();
    jacobian_ = analysis().times(imposed_->slope());
    return true;
  }
  if (!response_->at(theta, search)) return false;
  const Eigen::MatrixXd all = analysis().matrix() * response_->curves(channel_);
  value_ = all.col(0);
  jacobian_ = all.rightCols(all.cols() - 1);
  return true;
}

Eigen::MatrixXd Prediction::over_excitation(int driver_harmonics) {
  const Eigen::MatrixXd curves =
      response_ ? response_->over_excitation(driver_harmonics) : Eigen::MatrixXd();
  if (curves.size() == 0) return Eigen::MatrixXd::Zero(value_.size(), 2 * driver_harmonics);
  return analysis().matrix() * curves;
}

Eigen::MatrixXd Prediction::over_record(const std::vector<double>& theta, Index count) const {
  if (!transient_ || sampled_->excitation.size() == 0) return Eigen::MatrixXd(value_.size(), 0);
  return diagnosis::over_excitation(*model_, theta, *sampled_, transient_->states(), value_.size(),
                                    count);
}

Eigen::MatrixXd Prediction::over_motion() {
  return imposed_ ? Eigen::MatrixXd(analysis().matrix() * imposed_->over_motion())
                  : Eigen::MatrixXd();
}

const LeftFactor& Prediction::analysis() {
  if (!analysis_)
    analysis_ = std::make_shared<const LeftFactor>(analysis_matrix(harmonics_, points_));
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

void Prediction::share(AnalysisMatrices& matrices) {
  if (!sampled_ && !analysis_) analysis_ = matrices.get(harmonics_, points_);
}

void Prediction::be_patient() {
  if (transient_) transient_->be_patient();
}

void Prediction::hold() {
  if (response_) response_->hold();
  if (transient_) transient_->hold();
}

void Prediction::go_back() {
  is_at_ = false;
  if (response_) response_->go_back();
  if (transient_) transient_->go_back();
}

void Prediction::start_beyond(const Prediction& finer, const Prediction& coarser) {
  is_at_ = false;
  if (response_) response_->start_beyond(*finer.response_, *coarser.response_);
  if (imposed_) imposed_->start_from(*finer.imposed_);
}

void Prediction::start_from(const Prediction& other) {
  is_at_ = false;
  if (alike(other) && other.analysis_) analysis_ = other.analysis_;
  if (imposed_ && other.imposed_) imposed_->start_from(*other.imposed_);
  if (integrator_ && other.integrator_) integrator_->begin_from(*other.integrator_);
  if (transient_ && other.transient_) transient_->start_from(*other.transient_);
  if (response_ && other.response_ && !follows_) response_->start_from(*other.response_);
}

}  // namespace shaker::estimator::diagnosis
