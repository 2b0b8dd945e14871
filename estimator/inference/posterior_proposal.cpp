#include "estimator/inference/internal/posterior_proposal.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/inference/internal/posterior_bend.hpp"
#include "estimator/inference/internal/posterior_valley.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTails = 5.0;        // degrees of freedom
constexpr double kWide = 4.0;         // covariance factor of the component that always remains
constexpr double kWideShare = 0.1;    // of the draws
constexpr std::size_t kCentres = 60;  // components of the mixture that follows draws
constexpr double kBendShare = 0.7;    // share of the curved t among the draws that follow draws
constexpr double kValleyShare = 0.8;  // share of the draws along a valley, if there is one

}  // namespace

VectorXd heavy_tailed(Eigen::Index size, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::gamma_distribution<double> gamma(0.5 * kTails, 2.0);
  VectorXd z(size);
  for (double& value : z)
    value = normal(random);
  return z * std::sqrt(kTails / gamma(random));
}

double heavy_tailed_density(const VectorXd& at, const VectorXd& centre, const MatrixXd& root) {
  const VectorXd z = lower_solve(root, VectorXd(at - centre));
  const auto d = static_cast<double>(at.size());
  const double constant = std::tgamma(0.5 * (kTails + d)) / std::tgamma(0.5 * kTails) /
                          std::pow(kTails * std::numbers::pi, 0.5 * d);
  return constant * std::pow(1.0 + z.squaredNorm() / kTails, -0.5 * (kTails + d)) /
         root.diagonal().prod();
}

Proposal::Proposal(const VectorXd& mode, const MatrixXd& covariance)
    : mode_(mode),
      wide_(Cholesky(kWide * covariance).root()),
      narrow_(Cholesky(1.2 * covariance).root()),
      centres_({mode}) {}

void Proposal::adapt(const Draws& draws) {
  std::vector<VectorXd> centres = even_choice(draws, kCentres);
  const auto d = static_cast<double>(mode_.size());
  // Silverman's kernel width for this number of centres.
  const double width =
      std::pow(4.0 / (static_cast<double>(centres.size()) * (d + 2.0)), 1.0 / (d + 4.0));
  const Cholesky factor(width * width * draws.covariance);
  if (!factor.positive()) return;
  narrow_ = factor.root();
  centres_ = std::move(centres);
  bend_ = std::make_shared<const Bend>(draws);
}

void Proposal::follow(std::shared_ptr<const Valley> valley) {
  valley_ = std::move(valley);
}

VectorXd Proposal::draw(std::mt19937_64& random) const {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  if (valley_ && uniform(random) < kValleyShare) return valley_->draw(random);
  const bool wide = uniform(random) < kWideShare;
  if (!wide && bend_ && uniform(random) < kBendShare) return bend_->draw(random);
  const VectorXd z = heavy_tailed(mode_.size(), random);
  if (wide) return mode_ + wide_ * z;
  const auto which =
      static_cast<std::size_t>(uniform(random) * static_cast<double>(centres_.size()));
  return centres_[std::min(which, centres_.size() - 1)] + narrow_ * z;
}

double Proposal::log_density(const VectorXd& at) const {
  double following = 0.0;
  for (const VectorXd& centre : centres_)
    following += heavy_tailed_density(at, centre, narrow_) / static_cast<double>(centres_.size());
  if (bend_) following = kBendShare * bend_->density(at) + (1.0 - kBendShare) * following;
  double sum = kWideShare * heavy_tailed_density(at, mode_, wide_) + (1.0 - kWideShare) * following;
  if (valley_) sum = kValleyShare * valley_->density(at) + (1.0 - kValleyShare) * sum;
  return std::log(std::max(sum, 1e-300));
}

}  // namespace shaker::estimator
