#include "estimator/design/internal/plan_candidates.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace shaker::estimator {
namespace {

constexpr int kGrid = 160;
constexpr double kSameSetpoint = 1e-3;  // relative

std::string refusal_of_setpoint(const PlanOptions& options, double frequency, double amplitude) {
  const PlanLimits& l = options.limits;
  if ((l.frequency_min_hz > 0.0 && frequency < l.frequency_min_hz) ||
      (l.frequency_max_hz > 0.0 && frequency > l.frequency_max_hz))
    return fmt::format("the rig allows {:g} to {:g} Hz", l.frequency_min_hz, l.frequency_max_hz);
  if (l.excitation_max > 0.0 && amplitude > l.excitation_max)
    return fmt::format("the rig allows an excitation of {:g}", l.excitation_max);
  // A set of most_runs runs must leave each of them a cycle.
  if (options.minutes > 0.0 &&
      60.0 * options.minutes / options.most_runs * frequency < options.settle_cycles + 1.0)
    return fmt::format("{:g} min do not suffice to settle and measure in each of {} runs",
                       options.minutes, options.most_runs);
  return {};
}

std::string refusal_of_motion(const PlanLimits& l, const PlanCandidate& c) {
  if (l.stroke_max > l.stroke_min && c.stroke_low < l.stroke_min)
    return fmt::format("the stroke would go down to {:.4g}; the rig allows {:g}", c.stroke_low,
                       l.stroke_min);
  if (l.stroke_max > l.stroke_min && c.stroke_high > l.stroke_max)
    return fmt::format("the stroke would go up to {:.4g}; the rig allows {:g}", c.stroke_high,
                       l.stroke_max);
  if (l.stroke_rate_max > 0.0 && c.rate > l.stroke_rate_max)
    return fmt::format("the stroke rate would be {:.3g}; the rig allows {:g}", c.rate,
                       l.stroke_rate_max);
  return {};
}

// The information of a candidate at one damper; empty where it is refused.
std::vector<double> information_at(const Model& model, const PlanOptions& options,
                                   const std::vector<double>& theta, const std::vector<int>& free,
                                   PlanCandidate& c) {
  const int every = (kGrid + options.points - 1) / options.points;
  PeriodicSystem system(model, {Scheme::order6, every * options.points, true});
  system.set_excitation(c.frequency_hz, c.amplitude);
  const SolveReport report = system.solve_from_rest(theta);
  if (report.status != SolveStatus::converged) {
    c.refused = report.sentence();
    return {};
  }
  c.stroke_low = c.stroke_high = system.value(0, model.observed());
  c.rate = 0.0;
  for (int i = 0; i < system.points(); ++i) {
    const double u = system.value(i, model.observed());
    c.stroke_low = std::min(c.stroke_low, u);
    c.stroke_high = std::max(c.stroke_high, u);
    c.rate = std::max(c.rate, std::fabs(system.velocity(i, model.observed())));
  }
  c.refused = refusal_of_motion(options.limits, c);
  if (!c.refused.empty()) return {};
  const std::size_t q = free.size();
  std::vector<double> information(q * q, 0.0);
  const double weight = options.cycles / (options.noise * options.noise);
  for (int i = 0; i < options.points; ++i) {
    const auto row = system.observed_row(i * every);
    for (std::size_t k = 0; k < q; ++k) {
      for (std::size_t l = 0; l < q; ++l)
        information[k * q + l] += weight * row[static_cast<std::size_t>(1 + free[k])] *
                                  row[static_cast<std::size_t>(1 + free[l])];
    }
  }
  return information;
}

// The factor between neighbours of a list of positive numbers; 1 for a single one.
double spacing(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const double ratio = values.back() / values.front();
  return std::pow(ratio, 1.0 / std::max<std::size_t>(1, values.size() - 1));
}

}  // namespace

double settable(double value) {
  const double power = std::pow(10.0, 2.0 - std::floor(std::log10(value)));
  return std::round(value * power) / power;
}

std::vector<double> point_of(const Model& model, const PlanOptions& options) {
  return options.theta.empty() ? model.start() : options.theta;
}

std::vector<PlanCandidate> grid_of(const PlanOptions& options) {
  std::vector<PlanCandidate> grid;
  for (const double frequency : options.frequencies_hz) {
    for (const double amplitude : options.amplitudes) {
      PlanCandidate& candidate = grid.emplace_back();
      candidate.frequency_hz = frequency;
      candidate.amplitude = amplitude;
    }
  }
  return grid;
}

bool possible_at(const Model& model, const PlanOptions& options, const std::vector<double>& theta,
                 PlanCandidate candidate) {
  candidate.refused = refusal_of_setpoint(options, candidate.frequency_hz, candidate.amplitude);
  if (candidate.refused.empty()) information_at(model, options, theta, {}, candidate);
  return candidate.refused.empty();
}

void examine(const Model& model, const PlanOptions& options, const std::vector<int>& free,
             PlanCandidate& c) {
  c.refused = refusal_of_setpoint(options, c.frequency_hz, c.amplitude);
  // The prior's points first, so that the motion that is shown is that at the point of
  // linearisation.
  for (const PlanPoint& point : options.prior) {
    if (!c.refused.empty()) return;
    c.over_prior.push_back(information_at(model, options, point.theta, free, c));
    if (!c.refused.empty()) c.refused += ", at a damper that the prior allows";
  }
  if (!c.refused.empty()) return;
  c.information = information_at(model, options, point_of(model, options), free, c);
}

std::vector<PlanCandidate> candidates_about(const std::vector<PlanSet>& sets, const Plan& plan,
                                            const PlanOptions& options, int round) {
  const double finer = std::pow(3.0, -round);
  const double f = std::pow(spacing(options.frequencies_hz), finer);
  const auto [least, most] =
      std::minmax_element(options.amplitudes.begin(), options.amplitudes.end());
  const double step = (*most - *least) /
                      static_cast<double>(std::max<std::size_t>(1, options.amplitudes.size() - 1)) *
                      finer;
  std::vector<PlanCandidate> found;
  const auto add = [&](double frequency, double amplitude) {
    const auto same = [&](const PlanCandidate& c) {
      return std::fabs(c.frequency_hz / frequency - 1.0) < kSameSetpoint &&
             std::fabs(c.amplitude / amplitude - 1.0) < kSameSetpoint;
    };
    if (!(amplitude > 0.0) || std::any_of(plan.candidates.begin(), plan.candidates.end(), same) ||
        std::any_of(found.begin(), found.end(), same))
      return;
    PlanCandidate candidate;
    candidate.frequency_hz = frequency;
    candidate.amplitude = amplitude;
    found.push_back(std::move(candidate));
  };
  for (const PlanSet& set : sets) {
    for (const std::size_t r : set.runs) {
      const PlanCandidate& at = plan.candidates[r];
      for (const double frequency :
           {settable(at.frequency_hz / f), at.frequency_hz, settable(at.frequency_hz * f)}) {
        for (const double amplitude : {at.amplitude - step, at.amplitude, at.amplitude + step})
          add(frequency,
              amplitude == at.amplitude || amplitude <= 0.0 ? amplitude : settable(amplitude));
      }
    }
  }
  return found;
}

}  // namespace shaker::estimator
