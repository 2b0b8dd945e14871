#include "estimator/solve/periodic/continuation.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "estimator/math/harmonic_basis.hpp"

namespace shaker::estimator {
namespace {

double clamp_between(double value, double a, double b) {
  return std::clamp(value, std::min(a, b), std::max(a, b));
}

std::string at(Along along, double value) {
  return along == Along::frequency ? fmt::format("{:.6g} Hz", value)
                                   : fmt::format("an amplitude of {:.6g}", value);
}

// Extreme value of the parabola through three points on equal steps.
double extreme(double before, double here, double after) {
  const double bend = before - 2.0 * here + after;
  return bend == 0.0 ? here : here - (after - before) * (after - before) / (8.0 * bend);
}

// Scalar product of the parts of two solutions that change sign after half the ring. It is negative
// when this part passed through zero between the two.
double half_ring(const ArcPoint& a, const ArcPoint& b) {
  const std::size_t half = a.z.size() / 2;
  double sum = 0.0;
  for (std::size_t k = 0; k < half; ++k)
    sum += (a.z[k] - a.z[k + half]) * (b.z[k] - b.z[k + half]);
  return sum;
}

}  // namespace

Continuation::Continuation(const Model& model, std::vector<double> theta,
                           ContinuationOptions options)
    : model_(&model), theta_(std::move(theta)), options_(options) {}

GridOptions Continuation::ring(int periods) const {
  GridOptions grid = options_.grid;
  grid.points *= periods;
  return grid;
}

SolutionArc Continuation::make_arc(const Branch& branch) const {
  const GridOptions grid = ring(branch.periods);
  return SolutionArc(*model_, theta_, grid, cosine_shape(grid.points, branch.periods),
                     branch.periods, branch.along, branch.held, std::fabs(branch.to - branch.from));
}

Branch Continuation::over_frequency(double amplitude, double from, double to) {
  return from_rest(Along::frequency, amplitude, from, to);
}

Branch Continuation::over_amplitude(double frequency_hz, double from, double to) {
  return from_rest(Along::amplitude, frequency_hz, from, to);
}

Branch Continuation::from_rest(Along along, double held, double from, double to) {
  PeriodicSystem system(*model_, ring(options_.periods));
  const double frequency = along == Along::frequency ? from : held;
  std::vector<double> points = cosine_shape(system.points(), options_.periods);
  for (double& x : points)
    x *= along == Along::frequency ? held : from;
  system.set_excitation_points(frequency / options_.periods, points);
  SolveReport report = system.solve_from_rest(theta_);
  if (report.status == SolveStatus::no_convergence) report = solve_through_folds(system, theta_);
  if (report.status == SolveStatus::converged)
    return from_state(along, held, from, from, to, system.state());
  Branch branch{along, held, from, to, options_.periods, {}, {}, false, {}};
  branch.ended = fmt::format("there is no start at {}: {}", at(along, from), report.sentence());
  return branch;
}

Branch Continuation::from_state(Along along, double held, double value, double from, double to,
                                std::span<const double> start) {
  Branch branch{along, held, from, to, options_.periods, {}, {}, false, {}};
  SolutionArc arc = make_arc(branch);
  ArcPoint first;
  if (!arc.solve_at(value, start, first)) {
    branch.ended = fmt::format(
        "there is no start at {}: Newton's method found no solution near "
        "the given state",
        at(along, value));
    return branch;
  }
  ArcPoint direction{std::vector<double>(first.z.size(), 0.0), to > from ? 1.0 : -1.0};
  walk(arc, std::move(first), std::move(direction), branch);
  return branch;
}

BranchPoint Continuation::describe(SolutionArc& arc, const ArcPoint& at, double turning) {
  BranchPoint point;
  point.frequency_hz = arc.frequency(at.value);
  point.amplitude = arc.amplitude(at.value);
  point.turning = turning;
  point.at = at;
  if (!arc.linearise(at)) return point;
  const PeriodicSystem& system = arc.system();
  const int n = system.points();
  const int c = model_->observed();
  point.least = point.most = system.value(0, c);
  for (int i = 0; i < n; ++i) {
    const double before = system.value((i + n - 1) % n, c), here = system.value(i, c),
                 after = system.value((i + 1) % n, c);
    if (here >= before && here >= after)
      point.most = std::max(point.most, extreme(before, here, after));
    if (here <= before && here <= after)
      point.least = std::min(point.least, extreme(before, here, after));
  }
  std::vector<double> observed;
  for (int i = 0; i < n; ++i)
    observed.push_back(system.value(i, c));
  for (int k = 0; k <= options_.harmonics * arc.periods(); ++k)
    point.harmonics.push_back(fourier_sum(observed, k) * (k == 0 ? 1.0 : 2.0) /
                              static_cast<double>(n));
  if (auto stability = floquet(system, theta_)) {
    point.floquet = *stability;
    point.stable = point.floquet.stable();
  }
  return point;
}

// Puts the point that left the range from its neighbour `before` back onto the limit.
void Continuation::end_at_limit(SolutionArc& arc, const ArcPoint& before, const ArcPoint& tangent,
                                double value, ArcPoint& point, ArcPoint& direction) {
  const double share = (value - before.value) / (point.value - before.value);
  ArcPoint guess = point;
  for (std::size_t k = 0; k < guess.z.size(); ++k)
    guess.z[k] = before.z[k] + share * (point.z[k] - before.z[k]);
  if (arc.solve_at(value, guess.z, guess)) point = guess;
  arc.tangent(point, tangent, direction);
}

void Continuation::walk(SolutionArc& arc, ArcPoint first, ArcPoint direction, Branch& branch) {
  const double low = std::min(branch.from, branch.to), high = std::max(branch.from, branch.to);
  const double sign = branch.to > branch.from ? 1.0 : -1.0;
  const StepLimits limits{options_.least_step, options_.greatest_step};
  double step = options_.first_step;
  ArcPoint point = first;
  const auto here = [&] { return at(branch.along, point.value); };
  arc.set_scale(point, direction);
  if (!arc.tangent(point, ArcPoint(direction), direction)) {
    branch.ended = "the equations are singular at the start";
    return;
  }
  branch.points.push_back(describe(arc, point, sign * direction.value));
  const ArcPoint first_direction = direction;
  while (branch.ended.empty() && static_cast<int>(branch.points.size()) < options_.most_points) {
    const ArcPoint before = point, tangent = direction;
    if (!arc.advance(point, direction, step, limits)) {
      branch.ended = fmt::format(
          "at {} the curve cannot be followed any further: no solution of the equations was found "
          "next to it (an inadmissible stroke, or a force too rough for the grid)",
          here());
      return;
    }
    const bool out = point.value < low || point.value > high;
    if (out)
      end_at_limit(arc, before, tangent, clamp_between(point.value, low, high), point, direction);
    BranchPoint next = describe(arc, point, sign * direction.value);
    const ArcPoint chord = difference(point, before);
    const double length = std::sqrt(arc.dot(chord, chord));
    next.arclength = branch.points.back().arclength + length;
    // Where a branch of twice the period joins the original one, the value turns too, but this is
    // no fold: the rest of the curve has the same solutions, one period later.
    const bool joins = branch.periods % 2 == 0 && half_ring(before, point) < 0.0;
    if (!joins) look_between(arc, branch.points.back(), next, tangent, branch);
    branch.points.push_back(std::move(next));
    const ArcPoint home = difference(first, point);
    if (out) {
      branch.complete = std::fabs(point.value - branch.to) < std::fabs(point.value - branch.from);
      branch.ended = fmt::format("{} at {}", branch.complete ? "got" : "came back", here());
      if (!branch.complete) branch.ended += "; beyond the last fold this curve has no solution";
    } else if (joins) {
      branch.ended = fmt::format("joins the solutions of half the period again at {}", here());
    } else if (branch.points.size() > 10 && arc.dot(home, home) < length * length &&
               arc.dot(direction, first_direction) > 0.0) {
      branch.ended = "the curve closes on itself";
    } else {
      // The measure of length follows the size of the motion from point to point.
      arc.set_scale(point, direction);
    }
  }
  if (branch.ended.empty())
    branch.ended = fmt::format("ended after {} points at {}", options_.most_points, here());
}

namespace {

// Solves at the full excitation, which lies between two points of an arc. It starts from their
// chord, then from the upper point.
bool solve_between(PeriodicSystem& system, std::span<const double> theta, const ArcPoint& below,
                   const ArcPoint& above) {
  const double share = (1.0 - below.value) / (above.value - below.value);
  for (const double along : {share, 1.0}) {
    for (std::size_t i = 0; i < above.z.size(); ++i)
      system.state()[i] = below.z[i] + along * (above.z[i] - below.z[i]);
    if (system.solve(theta).status == SolveStatus::converged) return true;
  }
  return false;
}

}  // namespace

SolveReport solve_through_folds(PeriodicSystem& system, std::span<const double> theta) {
  constexpr double kLittle = 1e-3;
  const std::vector<double> shape(system.excitation().begin(), system.excitation().end());
  const double frequency = system.frequency();
  std::vector<double> little = shape;
  for (double& x : little)
    x *= kLittle;
  system.set_excitation_points(frequency, little);
  SolveReport report = system.solve_from_rest(theta);
  const std::vector<double> rest(system.state().begin(), system.state().end());
  system.set_excitation_points(frequency, shape);
  if (report.status != SolveStatus::converged) {
    report.amplitude_reached *= kLittle;
    return report;
  }
  SolutionArc arc(system.model(), {theta.begin(), theta.end()}, system.options(), shape, 1,
                  Along::amplitude, frequency, 1.0);
  ArcPoint point{rest, kLittle}, direction{std::vector<double>(rest.size(), 0.0), 1.0};
  arc.set_scale(point, direction);
  if (!arc.tangent(point, ArcPoint(direction), direction)) return report;
  double step = 0.01;
  report.amplitude_reached = kLittle;
  report.status = SolveStatus::no_convergence;
  for (int count = 0; count < 1000 && point.value >= 0.5 * kLittle; ++count) {
    const ArcPoint last = point;
    const double before = direction.value;
    if (!arc.advance(point, direction, step, {1e-6, 0.2})) break;
    report.turned_back = report.turned_back || (before > 0.0 && direction.value < 0.0);
    if (point.value >= 1.0) {
      if (solve_between(system, theta, last, point)) return {};
      report.amplitude_reached = std::max(report.amplitude_reached, last.value);
      return report;
    }
    report.amplitude_reached = std::max(report.amplitude_reached, point.value);
    arc.set_scale(point, direction);
  }
  return report;
}

}  // namespace shaker::estimator
