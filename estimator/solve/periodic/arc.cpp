#include "estimator/solve/periodic/internal/arc.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/math/harmonic_basis.hpp"

namespace shaker::estimator {
namespace {

constexpr double kConverged = 1e-11;  // length of a Newton step, in the arc's measure
constexpr double kBottom = 1e-8;      // a shorter step that no longer shrinks is rounding

constexpr double kSharp = 0.94;      // smallest accepted cosine between successive tangents
constexpr double kStraight = 0.995;  // a greater cosine lets the step grow

}  // namespace

std::vector<double> cosine_shape(int points, int periods) {
  std::vector<double> shape;
  for (int i = 0; i < points; ++i)
    shape.push_back(harmonic_term(2 * periods - 1, i, points));
  return shape;
}

SolutionArc::SolutionArc(const Model& model, std::vector<double> theta, GridOptions grid,
                         std::vector<double> shape, int periods, Along along, double held,
                         double range)
    : system_(model, grid),
      theta_(std::move(theta)),
      shape_(std::move(shape)),
      periods_(periods),
      along_(along),
      held_(held),
      range_(range) {
  points_.resize(shape_.size());
  rows_.resize(2 * system_.state().size());
  weight_.assign(static_cast<std::size_t>(model.coordinates()), 1.0);
}

ArcPoint difference(const ArcPoint& a, const ArcPoint& b) {
  ArcPoint d = a;
  for (std::size_t k = 0; k < d.z.size(); ++k)
    d.z[k] -= b.z[k];
  d.value -= b.value;
  return d;
}

void SolutionArc::normalise(ArcPoint& direction) const {
  const double unit = std::sqrt(dot(direction, direction));
  for (double& z : direction.z)
    z /= unit;
  direction.value /= unit;
}

void SolutionArc::set_scale(const ArcPoint& point, ArcPoint& direction) {
  const std::size_t s = weight_.size();
  std::vector<double> motion(s);
  for (std::size_t c = 0; c < s; ++c) {
    double mean = 0.0, square = 0.0;
    for (std::size_t k = c; k < point.z.size(); k += s) {
      mean += point.z[k];
      square += point.z[k] * point.z[k];
    }
    const double n = static_cast<double>(point.z.size() / s);
    mean /= n;
    motion[c] = std::sqrt(std::max(square / n - mean * mean, 1e-12 * square / n));
  }
  const double most = std::max(*std::max_element(motion.begin(), motion.end()), 1e-12);
  const double count = static_cast<double>(point.z.size());
  for (std::size_t c = 0; c < s; ++c) {
    const double scale = std::max(motion[c], 1e-3 * most);
    weight_[c] = 1.0 / (scale * scale * count);
  }
  normalise(direction);
}

double SolutionArc::dot(const ArcPoint& a, const ArcPoint& b) const {
  const std::size_t s = weight_.size();
  double sum = a.value * b.value / (range_ * range_);
  for (std::size_t k = 0; k < a.z.size(); ++k)
    sum += weight_[k % s] * a.z[k] * b.z[k];
  return sum;
}

void SolutionArc::excite(double value) {
  const double a = amplitude(value);
  for (std::size_t i = 0; i < points_.size(); ++i)
    points_[i] = a * shape_[i];
  system_.set_excitation_points(frequency(value) / periods_, points_);
}

bool SolutionArc::linearise(const ArcPoint& point) {
  excite(point.value);
  std::copy(point.z.begin(), point.z.end(), system_.state().begin());
  return system_.linearise(theta_);
}

bool SolutionArc::solve_at(double value, std::span<const double> start, ArcPoint& out) {
  excite(value);
  std::copy(start.begin(), start.end(), system_.state().begin());
  if (system_.solve(theta_).status != SolveStatus::converged) return false;
  out.value = value;
  out.z.assign(system_.state().begin(), system_.state().end());
  return true;
}

// Factorises the ring at `point` and solves for the rows: the Newton step and dz/dvalue. Velocities
// are proportional to the frequency and accelerations to its square, including the corrections at
// kinks.
bool SolutionArc::factorise(const ArcPoint& point) {
  if (!linearise(point) || !system_.factorise()) return false;
  const int s = system_.model().coordinates();
  std::size_t row = 0;
  for (int i = 0; i < system_.points(); ++i) {
    for (int d = 0; d < s; ++d, ++row) {
      double over_value = 0.0;
      if (along_ == Along::amplitude) {
        over_value = -system_.model().excitation(d) * shape_[static_cast<std::size_t>(i)];
      } else {
        for (int c = 0; c < s; ++c)
          over_value += (system_.g_v(i, d, c) * system_.velocity(i, c) +
                         2.0 * system_.g_a(i, d, c) * system_.acceleration(i, c)) /
                        point.value;
      }
      rows_[2 * row] = -system_.g(i, d);
      rows_[2 * row + 1] = -over_value;
    }
  }
  system_.solve_factorised(rows_, 2);
  return std::all_of(rows_.begin(), rows_.end(), [](double v) { return std::isfinite(v); });
}

int SolutionArc::correct(const ArcPoint& guess, const ArcPoint& direction, ArcPoint& out,
                         int most) {
  out = guess;
  ArcPoint newton = guess, rate = guess, apart = guess;
  rate.value = 1.0;
  newton.value = 0.0;
  double previous = 1e300;
  for (int iteration = 1; iteration <= most; ++iteration) {
    if (!(out.value > 0.0) || !factorise(out)) return 0;
    for (std::size_t k = 0; k < out.z.size(); ++k) {
      newton.z[k] = rows_[2 * k];
      rate.z[k] = rows_[2 * k + 1];
      apart.z[k] = out.z[k] - guess.z[k];
    }
    apart.value = out.value - guess.value;
    const double change = -(dot(direction, apart) + dot(direction, newton)) / dot(direction, rate);
    if (!std::isfinite(change)) return 0;
    for (std::size_t k = 0; k < out.z.size(); ++k)
      apart.z[k] = newton.z[k] + change * rate.z[k];
    apart.value = change;
    for (std::size_t k = 0; k < out.z.size(); ++k)
      out.z[k] += apart.z[k];
    out.value += change;
    const double length = std::sqrt(dot(apart, apart));
    if (length < kConverged || (length < kBottom && length > 0.3 * previous)) return iteration;
    if (length > 10.0 || (iteration > 2 && length > 2.0 * previous)) return 0;
    previous = length;
  }
  return 0;
}

bool SolutionArc::advance(ArcPoint& point, ArcPoint& direction, double& step, StepLimits limits) {
  ArcPoint guess = point, next, onward;
  for (; step >= limits.least; step *= 0.5) {
    for (std::size_t k = 0; k < guess.z.size(); ++k)
      guess.z[k] = point.z[k] + step * direction.z[k];
    guess.value = point.value + step * direction.value;
    const int iterations = correct(guess, direction, next);
    if (iterations == 0 || !tangent(next, direction, onward)) continue;
    const double bend = dot(direction, onward);
    if (bend < kSharp && step > 100.0 * limits.least) continue;
    if (iterations <= 4 && bend > kStraight) step = std::min(1.5 * step, limits.greatest);
    point = next;
    direction = onward;
    return true;
  }
  return false;
}

bool SolutionArc::tangent(const ArcPoint& point, const ArcPoint& like, ArcPoint& out) {
  if (!factorise(point)) return false;
  out = point;
  for (std::size_t k = 0; k < out.z.size(); ++k)
    out.z[k] = rows_[2 * k + 1];
  out.value = 1.0;
  double length = std::sqrt(dot(out, out));
  if (!std::isfinite(length)) return false;
  if (dot(out, like) < 0.0) length = -length;
  for (double& value : out.z)
    value /= length;
  out.value /= length;
  return true;
}

bool SolutionArc::critical_direction(const ArcPoint& point, ArcPoint& direction) {
  direction.value = 0.0;
  if (!linearise(point) || !system_.factorise()) return false;
  for (int round = 0; round < 4; ++round) {
    system_.solve_factorised(direction.z, 1);
    const double length = std::sqrt(dot(direction, direction));
    if (!(length > 0.0) || !std::isfinite(length)) return false;
    for (double& value : direction.z)
      value /= length;
  }
  return true;
}

}  // namespace shaker::estimator
