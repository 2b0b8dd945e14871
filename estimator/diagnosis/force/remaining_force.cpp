#include "estimator/diagnosis/force/internal/remaining_force.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/internal/motion_integrator.hpp"
#include "estimator/diagnosis/force/internal/remaining_words.hpp"
#include "estimator/diagnosis/noise/internal/transient.hpp"
#include "estimator/diagnosis/records/internal/transient_cosines.hpp"
#include "estimator/math/dense.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kCells = 24;        // of the stroke and of the velocity
constexpr double kLinear = 0.02;  // of the largest force: what grid and linearisation leave open

// One run as it was measured, with what the model makes of it there.
struct Course {
  VectorXd u, v;
  MatrixXd slope;     // of the force over the fitted parameters
  VectorXd residual;  // whitened
  MatrixXd jacobian;  // whitened, over the fitted parameters
  MatrixXd reach;     // whitened: of a force at each point, on what is compared; or, of a record,
                      // nothing: `transform` does that
  std::shared_ptr<const SampledRun> sampled;
  VectorXd error;  // of a record's cosines

  MatrixXd seen(const MatrixXd& at_points) const {
    if (!sampled) return reach * at_points;
    return error.cwiseInverse().asDiagonal() *
           CosineTransform(sampled->samples()).analyse(at_points, sampled->keep);
  }
};

MatrixXd columns_of(const MatrixXd& all, const std::vector<int>& some) {
  MatrixXd out(all.rows(), static_cast<Index>(some.size()));
  for (std::size_t k = 0; k < some.size(); ++k)
    out.col(static_cast<Index>(k)) = all.col(some[k]);
  return out;
}

// A record: the balance of forces along the measured motion, whatever was compared.
std::optional<Course> of_record(const HarmonicFit& fit, const RunDatum& datum, std::size_t r) {
  const SampledRun& run = *datum.sampled;
  const bool imposed = run.kind == Kind::imposed_motion;
  MotionIntegrator integrator(*fit.run_models[r],
                              Motion{run.dt, run.u, run.v, run.a, run.excitation}, !imposed);
  if (!integrator.at(fit.theta)) return std::nullopt;
  Course course;
  course.u = run.u;
  course.v = run.v;
  course.slope = columns_of(integrator.slope(), fit.free);
  course.sampled = datum.sampled;
  course.error = datum.by_force ? datum.error : balance_of_forces(datum).error;
  VectorXd left = -integrator.force();
  if (imposed) left += run.response;
  course.residual = course.seen(left);
  course.jacobian = course.seen(course.slope);
  return course;
}

// Of a force added to a periodic system's left side, a point each, on the response's harmonics:
// there are fewer of these than of points.
MatrixXd reach_of(const PeriodicSystem& from, const std::vector<double>& theta, int harmonics) {
  PeriodicSystem system = from.anew();
  const int n = from.points(), s = from.model().coordinates();
  if (!system.linearise(theta) || !system.factorise()) return {};
  const MatrixXd analysis = analysis_matrix(harmonics, n);
  const auto width = static_cast<int>(analysis.rows());
  std::vector<double> rows(static_cast<std::size_t>(n * s * width));
  const auto row_of = [&](int point, int coordinate) {
    return Eigen::Map<VectorXd>(&rows[static_cast<std::size_t>((point * s + coordinate) * width)],
                                width);
  };
  for (int i = 0; i < n; ++i)
    row_of(i, from.model().observed()) = -analysis.col(i);
  system.solve_transposed(rows, width);
  MatrixXd reach(width, n);
  for (int i = 0; i < n; ++i)
    reach.col(i) = row_of(i, 0);
  return reach;
}

std::optional<Course> of_cycle(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                               std::size_t r, int& points_of_imposed) {
  const RunDatum& datum = data[r];
  const Prediction& prediction = fit.predictions[r];
  const bool imposed = prediction.imposed() != nullptr;
  if (imposed && points_of_imposed == 0) points_of_imposed = prediction.points();
  const int n = imposed ? points_of_imposed : prediction.points();
  const VectorXd& motion = imposed ? datum.driver : datum.response;
  const VectorXd rate = derivative(motion, datum.frequency_hz);
  const auto table = synthesis_matrix(static_cast<int>((motion.size() - 1) / 2), n);
  Course course;
  course.u = table * motion;
  course.v = table * rate;
  const VectorXd a = table * derivative(rate, datum.frequency_hz);
  VectorXd x;
  if (!imposed) x = Eigen::Map<const VectorXd>(prediction.response()->excitation().data(), n);
  MotionIntegrator integrator(
      *fit.run_models[r], Motion{1.0 / (datum.frequency_hz * n), course.u, course.v, a, x, true},
      !imposed);
  if (!integrator.at(fit.theta)) return std::nullopt;
  course.slope = columns_of(integrator.slope(), fit.free);
  course.residual = whitened_residual(fit, data, r);
  course.jacobian = whitened_jacobian(fit, data, r, fit.free);
  const MatrixXd reach = imposed ? analysis_matrix(datum.harmonics(), n)
                                 : reach_of(*prediction.response(), fit.theta, datum.harmonics());
  if (reach.size() == 0) return std::nullopt;
  course.reach = whitened(datum, reach);
  // The time base may be off; one column for all runs.
  course.jacobian.conservativeResize(Eigen::NoChange, course.jacobian.cols() + 1);
  course.jacobian.rightCols(1).setZero();
  if (datum.clock.size() > 0) course.jacobian.rightCols(1) = whitened(datum, datum.clock);
  return course;
}

std::vector<Course> courses(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                            int& points_of_imposed) {
  std::vector<Course> all;
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    auto one =
        data[r].sampled ? of_record(fit, data[r], r) : of_cycle(fit, data, r, points_of_imposed);
    if (one) all.push_back(std::move(*one));
  }
  return all;
}

// Cells of the grid that the motion visits, with the means of points over each.
struct Grid {
  std::vector<ForceCell> cells;
  std::vector<std::vector<Index>> cell_of;  // of each point of each course
  std::vector<double> weight;               // of one point of each course
  double stroke_step = 0.0, velocity_step = 0.0;

  MatrixXd means(const std::vector<MatrixXd>& at_points) const {
    MatrixXd sum = MatrixXd::Zero(static_cast<Index>(cells.size()), at_points.front().cols());
    for (std::size_t r = 0; r < at_points.size(); ++r) {
      for (Index i = 0; i < at_points[r].rows(); ++i)
        sum.row(cell_of[r][static_cast<std::size_t>(i)]) += weight[r] * at_points[r].row(i);
    }
    for (std::size_t c = 0; c < cells.size(); ++c)
      sum.row(static_cast<Index>(c)) /= cells[c].time;
    return sum;
  }
};

Grid grid_of(const std::vector<Course>& all, double low, double high, double speed) {
  Grid grid;
  grid.stroke_step = (high - low) / kCells;
  grid.velocity_step = 2.0 * speed / kCells;
  std::map<std::pair<int, int>, Index> known;
  const auto place = [](double share) {
    return std::clamp(static_cast<int>(share), 0, kCells - 1);
  };
  for (const Course& course : all) {
    grid.weight.push_back(
        1.0 / static_cast<double>(all.size() * static_cast<std::size_t>(course.u.size())));
    std::vector<Index> of;
    for (Index i = 0; i < course.u.size(); ++i) {
      const auto [at, fresh] = known.try_emplace({place((course.v[i] + speed) / grid.velocity_step),
                                                  place((course.u[i] - low) / grid.stroke_step)},
                                                 static_cast<Index>(grid.cells.size()));
      if (fresh) grid.cells.emplace_back();
      ForceCell& cell = grid.cells[static_cast<std::size_t>(at->second)];
      cell.time += grid.weight.back();
      cell.stroke += grid.weight.back() * course.u[i];
      cell.velocity += grid.weight.back() * course.v[i];
      of.push_back(at->second);
    }
    grid.cell_of.push_back(std::move(of));
  }
  for (ForceCell& cell : grid.cells) {
    cell.stroke /= cell.time;
    cell.velocity /= cell.time;
  }
  return grid;
}

// Takes out of forces at the cells, a column each, what the force's slopes over the parameters can
// do, the cells counted by the time that is spent in them.
MatrixXd less_parameters(const Grid& grid, const MatrixXd& slopes, const MatrixXd& forces) {
  VectorXd root(static_cast<Index>(grid.cells.size()));
  for (Index c = 0; c < root.size(); ++c)
    root[c] = std::sqrt(grid.cells[static_cast<std::size_t>(c)].time);
  MatrixXd weighted = root.asDiagonal() * slopes;
  for (Index k = 0; k < weighted.cols(); ++k)
    weighted.col(k) /= std::max(weighted.col(k).norm(), 1e-300);
  const SingularValues svd = singular_values_of(weighted);
  const VectorXd& values = svd.values;
  Index rank = 0;
  while (rank < values.size() && values[rank] > 1e-8 * values[0])
    ++rank;
  const MatrixXd basis = svd.u.leftCols(rank);
  const MatrixXd scaled = root.asDiagonal() * forces;
  return root.cwiseInverse().asDiagonal() * (scaled - basis * (basis.transpose() * scaled));
}

// Takes out of forces at the cells what the fit's parameters do beside them. `coefficients`: the
// splines', of each force. The fit weighs what is compared, the response as a rule, and not the
// force.
MatrixXd beside_estimates(const SurfaceData& seen, const MatrixXd& slopes,
                          const MatrixXd& coefficients, const MatrixXd& forces) {
  const VectorXd inverse = seen.nuisance.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  const PivotedQr factor(seen.nuisance * inverse.asDiagonal());
  const MatrixXd moved = inverse.asDiagonal() * factor.solve(seen.reach);
  return forces - slopes * (moved.topRows(slopes.cols()) * coefficients);
}

// The surface's mean at the cells, then a column for each direction in which it is uncertain. Few
// splines reach a cell.
MatrixXd at_cells(const MatrixXd& splines, const MatrixXd& coefficients) {
  const MatrixXd across = coefficients.transpose();
  MatrixXd forces = MatrixXd::Zero(across.rows(), splines.rows());
  for (Index c = 0; c < splines.rows(); ++c) {
    for (Index k = 0; k < splines.cols(); ++k) {
      if (splines(c, k) != 0.0) forces.col(c) += splines(c, k) * across.col(k);
    }
  }
  return forces.transpose();
}

// Means and standard errors of the force, from `at_cells`.
void put_forces(const MatrixXd& forces, double ForceCell::*mean, double ForceCell::*standard_error,
                std::vector<ForceCell>& cells) {
  const double linear = kLinear * forces.col(0).cwiseAbs().maxCoeff();
  for (Index c = 0; c < forces.rows(); ++c) {
    ForceCell& cell = cells[static_cast<std::size_t>(c)];
    cell.*mean = forces(c, 0);
    cell.*standard_error =
        std::sqrt(forces.row(c).tail(forces.cols() - 1).squaredNorm() + linear * linear);
  }
}

}  // namespace

std::optional<RemainingForce> remaining_force(const HarmonicFit& fit,
                                              const std::vector<RunDatum>& data,
                                              bool errors_of_model, SeenPriors& known) {
  std::vector<Course> all;
  try {
    all = courses(fit, data, known.points);
  } catch (const std::invalid_argument&) {
    return std::nullopt;  // a motion cannot be imposed on this model
  }
  if (all.empty()) return std::nullopt;
  double low = 1e300, high = -1e300, speed = 0.0;
  Index rows = 0;
  for (const Course& course : all) {
    low = std::min(low, course.u.minCoeff());
    high = std::max(high, course.u.maxCoeff());
    speed = std::max(speed, course.v.cwiseAbs().maxCoeff());
    rows += course.residual.size();
  }
  if (!(high > low) || !(speed > 0.0)) return std::nullopt;
  const ForceSurface surface(low, high, speed);
  const Grid grid = grid_of(all, low, high, speed);
  std::vector<MatrixXd> splines, slopes;
  SurfaceData seen{VectorXd(rows), MatrixXd(rows, surface.size()),
                   MatrixXd(rows, all.front().jacobian.cols())};
  Index at = 0;
  for (const Course& course : all) {
    splines.push_back(surface.splines(course.u, course.v));
    slopes.push_back(course.slope);
    const Index size = course.residual.size();
    seen.residual.segment(at, size) = course.residual;
    seen.reach.middleRows(at, size) = course.seen(splines.back());
    seen.nuisance.middleRows(at, size) = course.jacobian;
    at += size;
  }
  const MatrixXd slope_means = grid.means(slopes), spline_means = grid.means(splines);
  const SurfaceFit fitted = surface.fit(seen, errors_of_model ? 1e-4 : 1.0, known);
  RemainingForce remaining;
  remaining.cells = grid.cells;
  remaining.share = fitted.share;
  remaining.stroke_step = grid.stroke_step;
  remaining.velocity_step = grid.velocity_step;
  MatrixXd coefficients(surface.size(), 1 + surface.size());
  coefficients << fitted.mean, fitted.spread.transpose();
  const MatrixXd forces = at_cells(spline_means, coefficients);
  put_forces(less_parameters(grid, slope_means, forces), &ForceCell::force,
             &ForceCell::standard_error, remaining.cells);
  put_forces(beside_estimates(seen, slope_means, coefficients, forces), &ForceCell::beside,
             &ForceCell::beside_error, remaining.cells);
  remaining.words = in_words(remaining, fit.spec.length_unit);
  return remaining;
}

}  // namespace shaker::estimator::diagnosis
