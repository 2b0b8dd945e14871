#include "estimator/online/internal/information_filter.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/QR>
#include <fmt/format.h>

#include "estimator/math/dense.hpp"

namespace shaker::estimator::online {
namespace {

constexpr int kMostSteps = 30;
constexpr double kStands = 1e-7;  // standard errors; a smaller step ends the iteration
constexpr int kHalvings = 12;

void fold_in(MeasuredCycle& mean, const MeasuredCycle& cycle, double share) {
  const auto towards = [share](double& a, double b) { a += share * (b - a); };
  towards(mean.frequency_hz, cycle.frequency_hz);
  towards(mean.amplitude, cycle.amplitude);
  for (std::size_t i = 0; i < mean.displacement.size(); ++i)
    towards(mean.displacement[i], cycle.displacement[i]);
  for (std::size_t i = 0; i < mean.excitation.size(); ++i)
    towards(mean.excitation[i], cycle.excitation[i]);
}

Eigen::VectorXd solve(const Eigen::MatrixXd& lambda, const Eigen::VectorXd& eta) {
  return shortest_least_squares(lambda, eta);
}

}  // namespace

InformationFilter::InformationFilter(const Model& model, std::vector<double> start,
                                     InformationOptions options)
    : model_(&model),
      options_(options),
      predictor_(model, options.grid_points),
      theta_(std::move(start)),
      linearisation_(theta_) {
  if (!(options.forgetting > 0.0) || options.forgetting > 1.0)
    throw std::invalid_argument(
        fmt::format("forgetting is {}; it must be above 0 and at most 1", options.forgetting));
  lambda_.setZero(predictor_.parameters(), predictor_.parameters());
  eta_.setZero(predictor_.parameters());
}

double InformationFilter::weight() const {
  double sum = 0.0;
  for (const auto& [run, mean] : runs_)
    sum += mean.weight;
  return sum;
}

double InformationFilter::noise() const {
  double points = 0.0;
  for (const auto& [run, mean] : runs_)
    points += mean.weight * static_cast<double>(mean.mean.displacement.size());
  const double left = squares_ - eta_.dot(solve(lambda_, eta_));
  const double degrees = points - predictor_.parameters();
  return degrees > 0.0 ? std::sqrt(std::max(left, 0.0) / degrees) : std::nan("");
}

Eigen::MatrixXd InformationFilter::covariance() const {
  const double s = noise();
  const auto p = lambda_.rows();
  return s * s * shortest_least_squares(lambda_, Eigen::MatrixXd::Identity(p, p));
}

bool InformationFilter::sum_up(const std::vector<double>& theta, Eigen::MatrixXd& lambda,
                               Eigen::VectorXd& eta, double& squares) {
  lambda.setZero(predictor_.parameters(), predictor_.parameters());
  eta.setZero(predictor_.parameters());
  squares = 0.0;
  Prediction at;
  for (const auto& [run, mean] : runs_) {
    if (!predictor_.predict(mean.mean, theta, false, at)) return false;
    const Eigen::VectorXd e =
        Eigen::Map<const Eigen::VectorXd>(mean.mean.displacement.data(), at.displacement.size()) -
        at.displacement;
    lambda += mean.weight * at.jacobian.transpose() * at.jacobian;
    eta += mean.weight * at.jacobian.transpose() * e;
    squares += mean.weight * e.squaredNorm() + mean.scatter;
  }
  return true;
}

bool InformationFilter::add(const MeasuredCycle& cycle) {
  for (auto& [run, mean] : runs_) {
    mean.weight *= options_.forgetting;
    mean.scatter *= options_.forgetting;
  }
  lambda_ *= options_.forgetting;
  eta_ *= options_.forgetting;
  squares_ *= options_.forgetting;
  RunMean& mean = runs_[cycle.run];
  if (mean.weight == 0.0) mean.mean = cycle;
  mean.weight += 1.0;
  double off = 0.0;
  const double share = 1.0 / mean.weight;
  for (std::size_t i = 0; i < cycle.displacement.size(); ++i) {
    const double d = cycle.displacement[i] - mean.mean.displacement[i];
    off += d * d;
  }
  mean.scatter += (1.0 - share) * off;
  fold_in(mean.mean, cycle, share);
  // Adds the new cycle, linearised at the present point of linearisation.
  Prediction at;
  if (!predictor_.predict(cycle, linearisation_, false, at)) return settle();
  const Eigen::VectorXd e =
      Eigen::Map<const Eigen::VectorXd>(cycle.displacement.data(), at.displacement.size()) -
      at.displacement;
  lambda_ += at.jacobian.transpose() * at.jacobian;
  eta_ += at.jacobian.transpose() * e;
  squares_ += e.squaredNorm();
  return settle();
}

// Computes theta from Lambda and eta. Linearises again while theta is far from that point.
bool InformationFilter::settle() {
  for (int step = 0; step < kMostSteps; ++step) {
    Eigen::VectorXd delta = solve(lambda_, eta_);
    const double s = noise();
    // Length of the step in standard errors.
    const double length = s > 0.0 ? std::sqrt(std::max(delta.dot(lambda_ * delta), 0.0)) / s : 0.0;
    const bool bounded = [&] {
      for (int k = 0; k < predictor_.parameters(); ++k) {
        const auto index = static_cast<std::size_t>(predictor_.free()[static_cast<std::size_t>(k)]);
        const ModelParameter& p = model_->parameters()[index];
        const double target = std::clamp(linearisation_[index] + delta[k], p.lower, p.upper);
        delta[k] = target - linearisation_[index];
      }
      return delta.allFinite();
    }();
    if (!bounded) return false;
    Eigen::MatrixXd lambda;
    Eigen::VectorXd eta;
    double squares = 0.0;
    std::vector<double> trial = linearisation_;
    const auto move = [&](double share) {
      for (int k = 0; k < predictor_.parameters(); ++k) {
        const auto index = static_cast<std::size_t>(predictor_.free()[static_cast<std::size_t>(k)]);
        trial[index] = linearisation_[index] + share * delta[k];
      }
    };
    move(1.0);
    if (length <= std::max(options_.relinearise, kStands)) {
      theta_ = trial;
      return true;
    }
    double share = 1.0;
    bool better = false;
    for (int half = 0; half < kHalvings && !better; ++half, share *= 0.5) {
      move(share);
      better = sum_up(trial, lambda, eta, squares) && squares <= squares_ * (1.0 + 1e-9);
    }
    if (!better) {
      // No better point: the minimum, or no solution. Keep the last good linearisation.
      theta_ = linearisation_;
      return length < 1.0;
    }
    linearisation_ = theta_ = trial;
    lambda_ = lambda;
    eta_ = eta;
    squares_ = squares;
  }
  return false;
}

}  // namespace shaker::estimator::online
