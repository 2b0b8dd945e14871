#include "estimator/fit/determination.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimator/math/dense.hpp"
#include "estimator/math/numbers.hpp"

namespace shaker::estimator {
namespace {

constexpr double kPart = 0.1;  // of the largest element: smaller ones are not mentioned

std::vector<std::size_t> free_and_determined(const Model& model, const Fit& fit) {
  std::vector<std::size_t> list;
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    if (!model.parameters()[k].fixed) list.push_back(k);
  }
  return list;
}

// Principal axes of the covariance relative to the parameters' sizes.
void add_weak(const Model& model, const Fit& fit, std::vector<Direction>& out) {
  const auto free = free_and_determined(model, fit);
  const auto q = static_cast<Eigen::Index>(free.size());
  if (q == 0 || fit.covariance.size() != free.size() * free.size()) return;
  Eigen::MatrixXd relative(q, q);
  for (Eigen::Index k = 0; k < q; ++k) {
    for (Eigen::Index l = 0; l < q; ++l)
      relative(k, l) = fit.covariance[static_cast<std::size_t>(k * q + l)] /
                       (size_of(fit.theta[free[static_cast<std::size_t>(k)]]) *
                        size_of(fit.theta[free[static_cast<std::size_t>(l)]]));
  }
  if (!relative.allFinite()) return;
  const Spectrum eigen = spectrum_of(relative);
  for (Eigen::Index i = q - 1; i >= 0; --i) {
    const double deviation = std::sqrt(std::max(eigen.values[i], 0.0));
    if (!(deviation > kWeak)) break;
    Direction direction;
    direction.change.assign(fit.theta.size(), 0.0);
    Eigen::VectorXd axis = deviation * eigen.vectors.col(i);
    Eigen::Index largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    if (axis[largest] < 0.0) axis = -axis;
    for (Eigen::Index k = 0; k < q; ++k)
      direction.change[free[static_cast<std::size_t>(k)]] = axis[k];
    out.push_back(std::move(direction));
  }
}

}  // namespace

std::vector<Direction> open_directions(const Model& model, const Fit& fit) {
  std::vector<Direction> out;
  for (const std::vector<double>& lost : fit.lost) {
    Direction direction;
    direction.lost = true;
    double largest = 0.0;
    for (std::size_t k = 0; k < lost.size(); ++k) {
      direction.change.push_back(lost[k] / size_of(fit.theta[k]));
      if (std::fabs(direction.change[k]) > std::fabs(largest)) largest = direction.change[k];
    }
    for (double& part : direction.change)
      part = largest != 0.0 ? part / largest : part;
    out.push_back(std::move(direction));
  }
  if (out.empty()) add_weak(model, fit, out);
  return out;
}

std::string in_words(const Model& model, const std::vector<double>& theta,
                     const Direction& direction) {
  double largest = 0.0;
  for (const double part : direction.change)
    largest = std::max(largest, std::fabs(part));
  std::vector<std::string> parts;
  for (std::size_t k = 0; k < direction.change.size(); ++k) {
    const double part = direction.change[k];
    if (!(std::fabs(part) > kPart * largest)) continue;
    const ModelParameter& p = model.parameters()[k];
    const double shown = direction.lost ? 0.01 * part : part;
    parts.push_back(theta[k] != 0.0 ? fmt::format("{} by {:+.2g} %", p.name, 100.0 * shown)
                                    : fmt::format("{} by {:+.2g} {}", p.name, shown, p.unit));
  }
  return fmt::format("{}", fmt::join(parts, " with "));
}

std::vector<std::string> determination_warnings(const Model& model, const Fit& fit) {
  std::vector<std::string> out;
  for (const Direction& direction : open_directions(model, fit)) {
    const std::string change = in_words(model, fit.theta, direction);
    const bool alone = change.find(" with ") == std::string::npos;
    if (direction.lost) {
      out.push_back(
          alone ? fmt::format("the data do not determine {}: changing it has no effect on what is "
                              "measured; fix it, or add a run in which it acts",
                              change.substr(0, change.find(' ')))
                : fmt::format("the data do not determine a combination: changing {} has no effect "
                              "on what is measured; fix one of them, give it a prior, or add runs "
                              "at other frequencies and amplitudes",
                              change));
    } else {
      out.push_back(fmt::format(
          "these data hardly determine a combination: changing {} is within one standard error, "
          "and the linearised intervals are rough there; take profile intervals, or add runs at a "
          "larger amplitude or another frequency",
          change));
    }
  }
  return out;
}

std::vector<std::string> closing_warnings(const std::vector<std::string>& on_bound,
                                          long observations, std::size_t unknowns) {
  std::vector<std::string> out;
  if (!on_bound.empty())
    out.push_back(fmt::format(
        "{} ended on a bound, so the standard errors do not hold; check the bound or the model",
        fmt::join(on_bound, ", ")));
  if (observations <= static_cast<long>(unknowns))
    out.push_back(fmt::format(
        "{} observations for {} unknowns leave no degree of freedom for the noise; no intervals "
        "can be given",
        observations, unknowns));
  return out;
}

}  // namespace shaker::estimator
