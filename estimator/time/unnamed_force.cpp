#include "estimator/time/unnamed_force.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFineSpeed = 0.15;    // of the fastest visited: the velocity's axis is even below
constexpr double kJumpSpeed = 0.01;    // of it: over which the force may jump at a reversal
constexpr double kJumpShare = 0.4;     // of the variance
constexpr double kLengthStroke = 0.7;  // of the visited stroke
constexpr double kLengthVelocity = 0.7;  // of the velocity's axis
constexpr std::size_t kMostCells = 150;  // that are conditioned on

struct ForceProcess {
  double low = 0.0, high = 0.0, fastest = 0.0, size = 0.0;

  // Outside of the visited stroke distances count by their logarithm.
  double along_stroke(double u) const {
    const double range = high - low;
    if (u < low) return -std::log1p((low - u) / range);
    if (u > high) return 1.0 + std::log1p((u - high) / range);
    return (u - low) / range;
  }
  double along_velocity(double v) const {
    return std::asinh(v / (kFineSpeed * fastest)) / std::asinh(1.0 / kFineSpeed);
  }
  double growth(double u, double v) const {
    const double speed = v / fastest;
    const double outside = std::max({0.0, low - u, u - high}) / (high - low);
    return size * (std::max(1.0, speed * speed) + outside);
  }
  double covariance(const VisitedCell& a, const VisitedCell& b) const {
    const double u = (along_stroke(a.stroke) - along_stroke(b.stroke)) / kLengthStroke;
    const double v = (along_velocity(a.velocity) - along_velocity(b.velocity)) / kLengthVelocity;
    const auto matern = [](double distance) {
      const double d = std::sqrt(3.0) * distance;
      return (1.0 + d) * std::exp(-d);
    };
    const double width = kJumpSpeed * fastest;
    const double ways = std::tanh(a.velocity / width) * std::tanh(b.velocity / width);
    return growth(a.stroke, a.velocity) * growth(b.stroke, b.velocity) *
           ((1.0 - kJumpShare) * matern(std::hypot(u, v)) +
            kJumpShare * ways * matern(std::fabs(u)));
  }
};

ForceProcess process_of(const IdentifiedDamper& damper) {
  ForceProcess process;
  process.low = 1e300;
  process.high = -1e300;
  double squares = 0.0;
  for (const VisitedCell& cell : damper.visited) {
    process.low = std::min(process.low, cell.stroke);
    process.high = std::max(process.high, cell.stroke);
    process.fastest = std::max(process.fastest, std::fabs(cell.velocity));
    squares += cell.force * cell.force / static_cast<double>(damper.visited.size());
  }
  process.size = std::max(damper.unnamed_force, std::sqrt(squares));
  return process;
}

std::vector<VisitedCell> thinned_cells(const std::vector<VisitedCell>& all) {
  if (all.size() <= kMostCells) return all;
  std::vector<VisitedCell> some;
  for (std::size_t i = 0; i < kMostCells; ++i)
    some.push_back(all[i * all.size() / kMostCells]);
  return some;
}

MatrixXd covariance_between(const ForceProcess& process, const std::vector<VisitedCell>& a,
                            const std::vector<VisitedCell>& b) {
  MatrixXd k(static_cast<Index>(a.size()), static_cast<Index>(b.size()));
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j)
      k(static_cast<Index>(i), static_cast<Index>(j)) = process.covariance(a[i], b[j]);
  }
  return k;
}

std::vector<double> listed(const VectorXd& values) {
  return {values.data(), values.data() + values.size()};
}

double turn_of(const VisitedCell& a, const VisitedCell& b, double stroke, double velocity) {
  return (b.stroke - a.stroke) * (velocity - a.velocity) -
         (b.velocity - a.velocity) * (stroke - a.stroke);
}

}  // namespace

ForceAlongPath unnamed_force_along(const IdentifiedDamper& damper,
                                   const std::vector<double>& stroke,
                                   const std::vector<double>& velocity, std::size_t most,
                                   double left) {
  ForceAlongPath force;
  const ForceProcess process = process_of(damper);
  if (damper.visited.size() < 3 || !(process.high > process.low) || !(process.fastest > 0.0))
    return force;
  std::vector<VisitedCell> path;
  for (std::size_t i = 0; i < stroke.size(); ++i)
    path.push_back({stroke[i], velocity[i]});
  const auto cells = thinned_cells(damper.visited);
  MatrixXd seen = covariance_between(process, cells, cells);
  VectorXd found(static_cast<Index>(cells.size()));
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const auto at = static_cast<Index>(c);
    // A cell in which nothing was estimated is known to hold no more than noise hides.
    const double error = std::max(cells[c].standard_error, 0.3 * damper.unnamed_force);
    found[at] = cells[c].force;
    seen(at, at) += error * error + 1e-9 * process.size * process.size;
  }
  const Cholesky factor(seen);
  if (!factor.positive()) return force;
  const MatrixXd across = covariance_between(process, cells, path);
  const MatrixXd weights = factor.solve(across);
  force.mean = listed(weights.transpose() * found);
  const MatrixXd spread = covariance_between(process, path, path) - across.transpose() * weights;
  const Spectrum eigen = spectrum_of(0.5 * (spread + spread.transpose()));
  const double all = eigen.values.cwiseMax(0.0).sum();
  double held = 0.0;
  for (Index k = eigen.values.size() - 1; k >= 0 && force.modes.size() < most; --k) {
    if (!(eigen.values[k] > 0.0) || all - held < left * all) break;
    held += eigen.values[k];
    force.modes.push_back(listed(std::sqrt(eigen.values[k]) * eigen.vectors.col(k)));
  }
  return force;
}

// Andrew's monotone chain.
VisitedRegion::VisitedRegion(const std::vector<VisitedCell>& cells) {
  std::vector<VisitedCell> points = cells;
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a.stroke != b.stroke ? a.stroke < b.stroke : a.velocity < b.velocity;
  });
  const auto chain = [&](auto begin, auto end) {
    const std::size_t kept = hull_.size();
    for (auto p = begin; p != end; ++p) {
      while (hull_.size() > kept + 1 &&
             turn_of(hull_[hull_.size() - 2], hull_.back(), p->stroke, p->velocity) <= 0.0)
        hull_.pop_back();
      hull_.push_back(*p);
    }
    if (!hull_.empty()) hull_.pop_back();
  };
  chain(points.begin(), points.end());
  chain(points.rbegin(), points.rend());
}

bool VisitedRegion::holds(double stroke, double velocity) const {
  if (empty()) return false;
  for (std::size_t i = 0; i < hull_.size(); ++i) {
    if (turn_of(hull_[i], hull_[(i + 1) % hull_.size()], stroke, velocity) < 0.0) return false;
  }
  return true;
}

}  // namespace shaker::estimator
