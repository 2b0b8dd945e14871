#include "estimator/time/drop.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/time/integration.hpp"

namespace shaker::estimator {
namespace {

constexpr int kSteps = 3000;          // in a history
constexpr double kFirstSteps = 0.02;  // of equal steps, at its begin
constexpr double kTolerance = 1e-9;
constexpr long kMaxAdamsSteps = 300;  // of a stiff model between two times: BDF is quicker then

double row_of(const std::vector<double>& given, std::size_t at, double otherwise) {
  return at < given.size() ? given[at] : otherwise;
}

// Weight in the first equation over the reference mass, from the model's gravity effects.
double weight_in(const config::ModelSpec& spec) {
  double weight = 0.0;
  for (const config::EffectSpec& effect : spec.effects) {
    if (effect.effect != "gravity") continue;
    double g = spec.gravity;
    for (const auto& constant : effect.constants)
      g = constant.second;
    weight += row_of(effect.acts, 0, 1.0) * g;
  }
  return weight;
}

std::vector<double> forces_of(const Model& model, double lift) {
  std::vector<double> force(static_cast<std::size_t>(model.coordinates()), 0.0);
  force[0] = -lift;
  return force;
}

double lift_of(const config::ModelSpec& spec, const Model& model, double share) {
  double mass = 0.0;  // of all equations, over the reference mass
  for (int d = 0; d < model.mechanical(); ++d)
    mass += model.excitation(d);
  return share * mass * spec.gravity;
}

// The times of a history are dense at touch-down, where a tyre or an oil spring takes the first
// blow in less than a millisecond. They are a smooth function of their index, and so everything is
// interpolated and integrated over the index.
double time_share(double share) {
  return share * (kFirstSteps + (1.0 - kFirstSteps) * share);
}

// The time's derivative over the index; exact, as the times are quadratic in it.
double time_rate(const std::vector<double>& t, std::size_t i) {
  if (i == 0) return 0.5 * (4.0 * t[1] - 3.0 * t[0] - t[2]);
  if (i + 1 == t.size()) return 0.5 * (3.0 * t[i] - 4.0 * t[i - 1] + t[i - 2]);
  return 0.5 * (t[i + 1] - t[i - 1]);
}

// A position between two times of a history.
struct Place {
  std::size_t before = 0;
  double share = 0.0;
  // Interpolates by the cubic through the four values around the position.
  double of(const std::vector<double>& values) const {
    const std::size_t first = std::min(before > 0 ? before - 1 : 0, values.size() - 4);
    const double at = static_cast<double>(before - first) + share;
    double sum = 0.0;
    for (int i = 0; i < 4; ++i) {
      double weight = 1.0;
      for (int k = 0; k < 4; ++k) {
        if (k != i) weight *= (at - k) / (i - k);
      }
      sum += weight * values[first + static_cast<std::size_t>(i)];
    }
    return sum;
  }
};

// Interpolates the stroke by the cubic through u and v at both ends.
double stroke_at(const DropHistory& h, const Place& p) {
  const double dt = h.t[p.before + 1] - h.t[p.before], s = p.share, s2 = s * s, s3 = s2 * s;
  return (2 * s3 - 3 * s2 + 1) * h.stroke[p.before] + (s3 - 2 * s2 + s) * dt * h.speed[p.before] +
         (3 * s2 - 2 * s3) * h.stroke[p.before + 1] + (s3 - s2) * dt * h.speed[p.before + 1];
}

// The place of the largest value: the top of the parabola through it and its neighbours, unless the
// curve jumps there, as friction does where the stroke turns.
struct Top {
  std::size_t at = 0;
  double shift = 0.0, value = 0.0;  // over the index
};
Top top_of(const std::vector<double>& values) {
  constexpr double kJumps = 8.0;  // times the bend beside
  Top top;
  top.at =
      static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
  top.value = values[top.at];
  if (top.at < 2 || top.at + 2 >= values.size()) return top;
  const auto bend = [&](std::size_t i) { return values[i + 1] - 2.0 * values[i] + values[i - 1]; };
  const double beside = std::min(std::fabs(bend(top.at - 1)), std::fabs(bend(top.at + 1)));
  if (!(bend(top.at) < 0.0) || -bend(top.at) > kJumps * beside) return top;
  const double slope = 0.5 * (values[top.at + 1] - values[top.at - 1]);
  top.shift = -slope / bend(top.at);
  top.value += 0.5 * slope * top.shift;
  return top;
}

}  // namespace

DropTest::DropTest(const config::ModelSpec& spec, DropConditions conditions)
    : model_(spec),
      conditions_(conditions),
      weight_(weight_in(spec)),
      lift_(lift_of(spec, model_, conditions.lift)),
      equations_(model_, forces_of(model_, lift_)) {
  const auto c = static_cast<std::size_t>(model_.coordinates());
  for (std::size_t e = 0; e < c; ++e)
    mass_.push_back(model_.mass(0, static_cast<int>(e)));
  if (!(conditions_.sink_speed > 0.0) || !std::isfinite(conditions_.sink_speed))
    throw std::invalid_argument(fmt::format("the sink speed is {} {}/s; it must be above 0",
                                            conditions_.sink_speed, model_.length_unit()));
  if (!(conditions_.lift >= 0.0 && conditions_.lift <= 1.0))
    throw std::invalid_argument(
        fmt::format("the lift is {} of the weight; it must be from 0 to 1", conditions_.lift));
  if (!(conditions_.duration > 0.0) || !std::isfinite(conditions_.duration))
    throw std::invalid_argument(
        fmt::format("the duration is {} s; it must be above 0", conditions_.duration));
  if (equations_.velocity_of(model_.observed()) < 0)
    throw std::invalid_argument("the model's observed coordinate has no mass, so it has no stroke");
  if (conditions_.contact < 0) {
    conditions_.contact = model_.mechanical() - 1;
  }
  if (conditions_.contact >= model_.mechanical() || equations_.velocity_of(conditions_.contact) < 0)
    throw std::invalid_argument(
        fmt::format("coordinate {} cannot meet the ground: the model has {}, counted from 0, and "
                    "it needs a mass",
                    conditions_.contact, model_.coordinates()));
}

Result<DropRun> DropTest::run(const std::vector<double>& theta, bool derivatives,
                              const Excitation& push) const {
  const auto m = static_cast<std::size_t>(equations_.states());
  TimeOptions options;
  options.relative_tolerance = kTolerance;
  options.absolute_tolerance = 1e-3 * kTolerance;
  options.max_steps = kMaxAdamsSteps;
  std::vector<int> all;
  for (int k = 0; k < model_.parameter_count(); ++k)
    all.push_back(k);
  DropRun out;
  for (int i = 0; i <= kSteps; ++i)
    out.history.t.push_back(conditions_.duration * time_share(static_cast<double>(i) / kSteps));
  Arc arc;
  arc.times = out.history.t;
  arc.excitation = &push;
  arc.start.assign(m, 0.0);
  for (int e = model_.mechanical(); e < model_.coordinates(); ++e)
    arc.start[static_cast<std::size_t>(e)] = model_.rest(e);
  arc.start[static_cast<std::size_t>(model_.observed())] = conditions_.extended;
  arc.start[static_cast<std::size_t>(equations_.velocity_of(conditions_.contact))] =
      conditions_.sink_speed;
  const auto integration = TimeIntegration::make(equations_, options, all);
  const auto report = integration->run({&arc, 1}, theta, derivatives);
  if (!report.ok) return Error{ErrorKind::not_converged, "the drop: " + report.sentence()};
  const auto u = static_cast<std::size_t>(model_.observed());
  const auto v = static_cast<std::size_t>(equations_.velocity_of(model_.observed()));
  for (std::size_t i = 0; i < out.history.t.size(); ++i) {
    out.history.stroke.push_back(arc.states[i * m + u] - conditions_.extended);
    out.history.speed.push_back(arc.states[i * m + v]);
    out.fastest = std::max(out.fastest, std::fabs(out.history.speed.back()));
  }
  loads(out, theta, arc.states, arc.sensitivities, push);
  if (auto good = read_off(out); !good) return good.error();
  return out;
}

// Computes the load at all times in one batch: weight - lift - inertia of the first equation.
void DropTest::loads(DropRun& out, const std::vector<double>& theta,
                     const std::vector<double>& states, const std::vector<double>& sensitivities,
                     const Excitation& push) const {
  const auto m = static_cast<std::size_t>(equations_.states());
  const auto p = static_cast<std::size_t>(model_.parameter_count());
  const std::size_t n = out.history.t.size(), stride = (n + 7) / 8 * 8;
  AlignedVector numbers(stride * (2 * m + m * m + m * p + 1), 0.0);
  std::vector<double*> s, rate, h_s, h_theta;
  double* at = numbers.data();
  const auto take = [&](std::vector<double*>& arrays, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i, at += stride)
      arrays.push_back(at);
  };
  take(s, m);
  take(rate, m);
  take(h_s, m * m);
  take(h_theta, m * p);
  double* x = at;
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = push.value(out.history.t[i]);
    for (std::size_t j = 0; j < m; ++j)
      s[j][i] = states[i * m + j];
  }
  StateEquations::Workspace work;
  equations_.rates(static_cast<int>(n), s.data(), x, theta.data(), work, rate.data(), h_s.data(),
                   h_theta.data());
  const bool derivatives = !sensitivities.empty();
  if (derivatives) {
    out.stroke_derivatives.assign(n * p, 0.0);
    out.load_derivatives.assign(n * p, 0.0);
  }
  const std::size_t columns = m + p;
  for (std::size_t i = 0; i < n; ++i) {
    double load = weight_ - lift_;
    for (int e = 0; e < model_.coordinates(); ++e) {
      const int v = equations_.velocity_of(e);
      const double mass = mass_[static_cast<std::size_t>(e)];
      if (v < 0 || mass == 0.0) continue;
      const auto row = static_cast<std::size_t>(v);
      load -= mass * rate[row][i];
      for (std::size_t k = 0; derivatives && k < p; ++k) {
        double slope = h_theta[row * p + k][i];
        for (std::size_t j = 0; j < m; ++j)
          slope += h_s[row * m + j][i] * sensitivities[(i * m + j) * columns + m + k];
        out.load_derivatives[i * p + k] -= mass * slope;
      }
    }
    out.history.load.push_back(load);
    for (std::size_t k = 0; derivatives && k < p; ++k)
      out.stroke_derivatives[i * p + k] =
          sensitivities[(i * m + static_cast<std::size_t>(model_.observed())) * columns + m + k];
  }
}

// Computes the figures of a drop. Reversals of the stroke are interpolated between the times of the
// history.
Result<void> DropTest::read_off(DropRun& run) const {
  const DropHistory& h = run.history;
  const std::size_t n = h.t.size();
  const auto turn = [&](std::size_t from, double sign) {
    for (std::size_t i = from; i + 1 < n; ++i) {
      if (sign * h.speed[i] > 0.0 && sign * h.speed[i + 1] <= 0.0)
        return Place{i, h.speed[i] / (h.speed[i] - h.speed[i + 1])};
    }
    return Place{n, 0.0};
  };
  // The deepest of all turns: an oil spring may turn the stroke before.
  Place peak = turn(0, 1.0);
  for (Place next = peak; next.before < n; next = turn(next.before + 1, 1.0)) {
    if (stroke_at(h, next) > stroke_at(h, peak)) peak = next;
  }
  if (peak.before == n)
    return Error{ErrorKind::not_converged,
                 fmt::format("the stroke is still growing after {} s; give a longer duration",
                             conditions_.duration)};
  const Place rebound = turn(peak.before + 1, -1.0);
  const bool rebounds = rebound.before < n;
  const std::size_t last = rebounds ? rebound.before + 1 : n - 1;
  const Top blow = top_of(h.load);
  const double largest = blow.value;
  // Work of the load on the stroke: each interval is the integral of the cubic through four
  // neighbouring values; the last interval of the history is a trapezoid.
  const auto work = [&](std::size_t from, std::size_t to) {
    double sum = 0.0;
    const auto power = [&](std::size_t i) { return h.load[i] * h.speed[i] * time_rate(h.t, i); };
    for (std::size_t i = from; i < to; ++i) {
      const double here = power(i), next = power(i + 1);
      sum += 0.5 * (here + next);
      if (i > 0 && i + 2 < n) {
        sum -= (power(i + 2) - next - here + power(i - 1)) / 24.0;
      } else if (i == 0 && n > 3) {
        sum = (9.0 * here + 19.0 * next - 5.0 * power(2) + power(3)) / 24.0;
      }
    }
    return sum;
  };
  const double stroke = stroke_at(h, peak);
  const double absorbed = work(0, peak.before + 1);
  const double returned = -work(peak.before + 1, last);
  std::size_t fastest_out = peak.before + 1;
  for (std::size_t i = fastest_out; i <= last; ++i) {
    if (h.speed[i] < h.speed[fastest_out]) fastest_out = i;
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  run.figures = {stroke,
                 h.t[peak.before] + peak.share * (h.t[peak.before + 1] - h.t[peak.before]),
                 largest - (weight_ - lift_),
                 largest,
                 peak.of(h.load),
                 rebounds ? stroke_at(h, rebound) : nan,
                 -h.speed[fastest_out],
                 absorbed,
                 absorbed - returned,
                 absorbed / (largest * stroke),
                 h.t[blow.at] + blow.shift * time_rate(h.t, blow.at)};
  return {};
}

}  // namespace shaker::estimator
