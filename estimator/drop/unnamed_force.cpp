#include "estimator/drop/unnamed_force.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "estimator/drop/internal/force_slopes.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFineSpeed = 0.15;  // of the fastest visited: the velocity's axis is even below
constexpr double kJumpSpeed = 0.01;  // of it: over which the force may jump at a reversal
constexpr double kJumpShare = 0.4;   // of the variance
constexpr std::size_t kMostCells = 150;     // that are conditioned on
constexpr std::size_t kCellsCompared = 75;  // by which the force's roughness is found
constexpr double kHidden = 0.3;             // of the least force, in a cell
constexpr double kLeastKept = 0.02;         // of the force's variance, by the parameters
// A force that is linear over the visited stroke changes by sqrt(12) of its root mean square there.
constexpr double kLinearChange = 3.4641016151377544;
// Powers of the speed that a damping may go with: from laminar flow, and from an orifice that the
// pressure closes. The base model has the 2 between them.
constexpr double kLawPowers[] = {1.0, 1.5, 2.5, 3.0};

// How rough the force is.
struct Roughness {
  double length_stroke = 0.7;    // over which it changes, of the visited stroke
  double length_velocity = 0.7;  // of the velocity's axis
  double orifice = 0.0;          // variance of an orifice's part, over that of the rest
};
constexpr double kLengthsStroke[] = {0.2, 0.35, 0.7, 1.4};
constexpr double kLengthsVelocity[] = {0.35, 0.7, 1.4};
constexpr double kOrificeParts[] = {0.0, 4.0, 100.0};  // none, twice the rest, nearly alone

struct ForceProcess {
  double low = 0.0, high = 0.0, fastest = 0.0, size = 0.0;
  double beyond = 0.0;  // how much it grows outside, over a distance as long as the visited stroke
  Roughness rough = {};

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
  double outside(double u) const { return std::max({0.0, low - u, u - high}) / (high - low); }
  // An orifice may change over the stroke: what it is outside of the visited one counts with the
  // square of the velocity too.
  double growth(double u, double v) const {
    const double speed = v / fastest;
    return size * std::max(1.0, speed * speed) * (1.0 + outside(u)) + beyond * outside(u);
  }
  // Of an orifice that changes over the stroke: what it is at a stroke, it is at any velocity there.
  double orifice(const VisitedCell& at) const {
    const double speed = at.velocity / fastest;
    return size * speed * std::fabs(speed) * (1.0 + outside(at.stroke));
  }
  double covariance(const VisitedCell& a, const VisitedCell& b) const {
    const double u = (along_stroke(a.stroke) - along_stroke(b.stroke)) / rough.length_stroke;
    const double v =
        (along_velocity(a.velocity) - along_velocity(b.velocity)) / rough.length_velocity;
    const auto matern = [](double distance) {
      const double d = std::sqrt(3.0) * distance;
      return (1.0 + d) * std::exp(-d);
    };
    const double width = kJumpSpeed * fastest;
    const double ways = std::tanh(a.velocity / width) * std::tanh(b.velocity / width);
    return growth(a.stroke, a.velocity) * growth(b.stroke, b.velocity) *
               ((1.0 - kJumpShare) * matern(std::hypot(u, v)) +
                kJumpShare * ways * matern(std::fabs(u))) +
           rough.orifice * orifice(a) * orifice(b) * matern(std::fabs(u));
  }
};

VectorXd law_at(const std::vector<VisitedCell>& points, double fastest, double power) {
  VectorXd force(static_cast<Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double speed = points[i].velocity / fastest;
    force[static_cast<Index>(i)] = std::copysign(std::pow(std::fabs(speed), power), speed);
  }
  return force;
}

ForceProcess process_of(const std::vector<VisitedCell>& cells, const UnnamedSize& size) {
  ForceProcess process;
  process.low = 1e300;
  process.high = -1e300;
  for (const VisitedCell& cell : cells) {
    process.low = std::min(process.low, cell.stroke);
    process.high = std::max(process.high, cell.stroke);
    process.fastest = std::max(process.fastest, std::fabs(cell.velocity));
  }
  process.size = std::max(size.least, root_mean_square(cells));
  process.beyond = std::max(process.size, kLinearChange * size.taken);
  return process;
}

// What acts in the cells, and the variance with which it is known there. A cell in which nothing was
// estimated is known to hold no more than noise hides.
struct CellForces {
  VectorXd found, variance;
};
CellForces cell_forces(const std::vector<VisitedCell>& cells, double hidden, double size) {
  CellForces out{VectorXd(static_cast<Index>(cells.size())),
                 VectorXd(static_cast<Index>(cells.size()))};
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const double error = std::max(cells[c].standard_error, hidden);
    out.found[static_cast<Index>(c)] = cells[c].force;
    out.variance[static_cast<Index>(c)] = error * error + 1e-9 * size * size;
  }
  return out;
}

std::vector<VisitedCell> thinned_cells(const std::vector<VisitedCell>& all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<VisitedCell> some;
  for (std::size_t i = 0; i < most; ++i)
    some.push_back(all[i * all.size() / most]);
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

// The forces of the damper's numbers, each moved by as much as it is, in the cells and along a path.
struct NumberForces {
  VectorXd scale;  // what the numbers are
  MatrixXd cells, path;
};

NumberForces number_forces(const DamperHypothesis* bent, const std::vector<VisitedCell>& cells,
                           const std::vector<VisitedCell>& path) {
  const NumberForces none{VectorXd(0), MatrixXd(static_cast<Index>(cells.size()), 0),
                          MatrixXd(static_cast<Index>(path.size()), 0)};
  if (bent == nullptr || bent->numbers.empty()) return none;
  const auto at_cells = force_slopes(*bent, cells), at_path = force_slopes(*bent, path);
  if (!at_cells || !at_path) return none;
  VectorXd scale(at_cells->cols());
  for (Index k = 0; k < scale.size(); ++k)
    scale[k] = std::fabs(value_of(bent->model, bent->numbers[static_cast<std::size_t>(k)]));
  return {scale, *at_cells * scale.asDiagonal(), *at_path * scale.asDiagonal()};
}

// What the numbers cannot take of forces in the cells, a column each, by least squares with the
// noise `error`.
MatrixXd left_of(const MatrixXd& forces, const NumberForces& numbers, double error) {
  if (numbers.scale.size() == 0) return forces;
  MatrixXd normal = numbers.cells.transpose() * numbers.cells;
  normal.diagonal().array() += error * error + 1e-12 * normal.trace();
  const Cholesky factor(normal);
  if (!factor.positive()) return forces;
  return forces - numbers.cells * factor.solve(MatrixXd(numbers.cells.transpose() * forces));
}

// The prior of the force in the cells and along the path.
struct ForcePrior {
  MatrixXd cells, between, path;  // between: path x cells

  void add(double variance, const MatrixXd& at_cells, const MatrixXd& at_path) {
    cells += variance * at_cells * at_cells.transpose();
    between += variance * at_path * at_cells.transpose();
    path += variance * at_path * at_path.transpose();
  }
};

// The numbers take a part of a force, and nearly all of one that is another law of the velocity. What
// is left is of the process' size; a law is at most as large as the force of a number.
ForcePrior force_prior(const ForceProcess& process, const std::vector<VisitedCell>& cells,
                       const std::vector<VisitedCell>& path, const NumberForces& numbers,
                       double error) {
  ForcePrior prior{covariance_between(process, cells, cells),
                   covariance_between(process, path, cells),
                   covariance_between(process, path, path)};
  const MatrixXd left = left_of(left_of(prior.cells, numbers, error).transpose(), numbers, error);
  const double larger = 1.0 / std::max(kLeastKept, left.trace() / prior.cells.trace());
  for (MatrixXd* part : {&prior.cells, &prior.between, &prior.path})
    *part *= larger;
  if (numbers.scale.size() == 0) return prior;
  for (const double power : kLawPowers) {
    const VectorXd at_cells = law_at(cells, process.fastest, power);
    const double size = process.size * std::sqrt(static_cast<double>(cells.size())) /
                        left_of(at_cells, numbers, error).norm();
    const double most =
        (numbers.cells.transpose() * at_cells).cwiseAbs().maxCoeff() / at_cells.squaredNorm();
    prior.add(std::pow(std::min(size, most), 2), at_cells, law_at(path, process.fastest, power));
  }
  return prior;
}

// The roughness under which the cells' forces are likeliest.
Roughness likeliest_roughness(ForceProcess process, const std::vector<VisitedCell>& all,
                              const DamperHypothesis* bent, double hidden) {
  const auto cells = thinned_cells(all, kCellsCompared);
  const auto [found, variance] = cell_forces(cells, hidden, process.size);
  Roughness best = process.rough;
  if (found.isZero(0.0)) return best;
  const NumberForces numbers = number_forces(bent, cells, cells);
  const MatrixXd known =
      numbers.cells * numbers.cells.transpose() + MatrixXd(variance.asDiagonal());
  double most = -std::numeric_limits<double>::infinity();
  for (const double stroke : kLengthsStroke) {
    for (const double velocity : kLengthsVelocity) {
      for (const double orifice : kOrificeParts) {
        process.rough = {stroke, velocity, orifice};
        const Cholesky factor(force_prior(process, cells, {}, numbers, hidden).cells + known);
        if (!factor.positive()) continue;
        const double evidence = -0.5 * factor.whiten(found).squaredNorm() -
                                factor.root().diagonal().array().log().sum();
        if (evidence > most) best = process.rough;
        most = std::max(most, evidence);
      }
    }
  }
  return best;
}

std::vector<double> listed(const VectorXd& values) {
  return {values.data(), values.data() + values.size()};
}

double turn_of(const VisitedCell& a, const VisitedCell& b, double stroke, double velocity) {
  return (b.stroke - a.stroke) * (velocity - a.velocity) -
         (b.velocity - a.velocity) * (stroke - a.stroke);
}

}  // namespace

double root_mean_square(const std::vector<VisitedCell>& cells) {
  double squares = 0.0;
  for (const VisitedCell& cell : cells)
    squares += cell.force * cell.force / static_cast<double>(cells.size());
  return std::sqrt(squares);
}

ForceAlongPath unnamed_force_along(const std::vector<VisitedCell>& visited,
                                   const UnnamedSize& size_there, const std::vector<double>& stroke,
                                   const std::vector<double>& velocity,
                                   const DamperHypothesis* bent, std::size_t most, double left) {
  ForceProcess process = process_of(visited, size_there);
  if (visited.size() < 3 || !(process.high > process.low) || !(process.fastest > 0.0)) return {};
  std::vector<VisitedCell> path;
  for (std::size_t i = 0; i < stroke.size(); ++i)
    path.push_back({stroke[i], velocity[i]});
  const auto cells = thinned_cells(visited, kMostCells);
  const auto [found, variance] = cell_forces(cells, kHidden * size_there.least, process.size);
  process.rough = likeliest_roughness(process, visited, bent, kHidden * size_there.least);
  const NumberForces numbers = number_forces(bent, cells, path);
  const ForcePrior prior = force_prior(process, cells, path, numbers, kHidden * size_there.least);
  const Cholesky factor(prior.cells + numbers.cells * numbers.cells.transpose() +
                        MatrixXd(variance.asDiagonal()));
  if (!factor.positive()) return {};
  // Rows: the force along the path, then the numbers over what they are.
  const auto points = static_cast<Index>(path.size());
  const Index size = points + numbers.scale.size();
  MatrixXd across(size, prior.cells.cols());
  across << prior.between, numbers.cells.transpose();
  MatrixXd whole = MatrixXd::Identity(size, size);
  whole.topLeftCorner(points, points) = prior.path;
  const VectorXd mean = across * factor.solve(found);
  whole -= across * factor.solve(MatrixXd(across.transpose()));
  ForceAlongPath force;
  force.mean = listed(mean.head(points));
  const auto shift_of = [&](const VectorXd& all) {
    return listed(numbers.scale.cwiseProduct(all.tail(size - points)));
  };
  force.mean_shift = shift_of(mean);
  // What acts is the force and what the numbers make of theirs.
  MatrixXd acts(points, size);
  acts << MatrixXd::Identity(points, points), numbers.path;
  const MatrixXd spread = whole * acts.transpose();
  const MatrixXd total = acts * spread;
  const Spectrum eigen = spectrum_of(0.5 * (total + total.transpose()));
  const double sum = eigen.values.cwiseMax(0.0).sum();
  double held = 0.0;
  for (Index k = eigen.values.size() - 1; k >= 0 && force.modes.size() < most; --k) {
    if (!(eigen.values[k] > 0.0) || sum - held < left * sum) break;
    held += eigen.values[k];
    const VectorXd mode = spread * eigen.vectors.col(k) / std::sqrt(eigen.values[k]);
    force.modes.push_back(listed(mode.head(points)));
    if (size > points) force.shifts.push_back(shift_of(mode));
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
