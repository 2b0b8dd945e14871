#include "estimator/diagnosis/select/internal/refits.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "estimator/diagnosis/fit/internal/jumping_friction.hpp"
#include "estimator/diagnosis/fit/internal/predicted_runs.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/internal/motion_range.hpp"
#include "estimator/diagnosis/noise/internal/first_fit.hpp"
#include "estimator/diagnosis/score/internal/scoring.hpp"
#include "estimator/diagnosis/select/internal/centring.hpp"
#include "estimator/diagnosis/select/internal/evidence.hpp"
#include "estimator/diagnosis/select/internal/nesting.hpp"
#include "estimator/diagnosis/select/internal/probe_starts.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kInterval = 2.0;  // standard errors
constexpr int kMemorySteps = 60;
constexpr int kQuickSteps = 8, kQuickShare = 4;  // of a look from another start: steps, points
constexpr int kMemoryShare = 2;                  // of a way on a coarse grid: the points
constexpr double kNearBest = 2.0;                // of chi-squared, times the best one's
constexpr double kNowhereNear = 30.0;            // the same, that no rival leaves

// Index of an effect's parameter in a model, for the last line of that effect; -1: none.
int find_parameter(const Model& model, const std::string& effect, std::string_view symbol) {
  const auto& parameters = model.parameters();
  for (std::size_t k = parameters.size(); k-- > 0;) {
    if (parameters[k].effect == effect && parameters[k].symbol == symbol)
      return static_cast<int>(k);
  }
  return -1;
}

// An estimate has errors. If an effect is as large as physics allows, half of its estimates fall
// beyond the bound. It is inadmissible only if its interval is.
bool ended_by_chance(const HarmonicFit& fit, const std::vector<RunDatum>& data, int parameter,
                     double absent) {
  const double size = std::fabs(fit.theta[static_cast<std::size_t>(parameter)] - absent);
  return size > kInterval * fit.standard_error(parameter) &&
         std::fabs(pull(fit, data, parameter)) <= kInterval;
}

// True if all coefficients of the effect are at their absent value.
bool is_off(const HarmonicFit& fit, std::size_t line) {
  const std::string& name = fit.spec.effects[line].effect;
  const Effect* effect = find_effect(name);
  if (effect == nullptr) return false;
  bool switchable = false;
  for (const ParameterInfo& info : effect->parameters()) {
    const int k = find_parameter(*fit.model, name, info.symbol);
    if (k < 0 || std::isnan(info.absent)) continue;
    switchable = true;
    if (fit.theta[static_cast<std::size_t>(k)] != info.absent) return false;
  }
  return switchable;
}

// An effect without a coefficient consists of its shape. If most of its parameters are undetermined
// or end at a bound, it imitates something else (a gas column without length a constant force).
bool has_no_shape(const HarmonicFit& fit, const Effect& effect) {
  const auto all = effect.parameters();
  std::size_t open = 0;
  for (const ParameterInfo& info : all) {
    const int k = find_parameter(*fit.model, std::string(effect.name()), info.symbol);
    if (!std::isnan(info.absent) || k < 0) return false;
    const double size = std::fabs(fit.theta[static_cast<std::size_t>(k)]);
    open += fit.at_bound(k) || !(fit.standard_error(k) < size) ? 1U : 0U;
  }
  return 2 * open > all.size();
}

// An effect that the fit switches off, or drives beyond its physical range, is not the missing one.
// Parameters that only shape it may end anywhere.
std::string disqualification(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                             std::size_t first_added, Errors errors) {
  if (!fit.converged) return fit.trouble.empty() ? "the fit did not settle" : fit.trouble;
  for (std::size_t i = first_added; i < fit.spec.effects.size(); ++i) {
    const std::string& name = fit.spec.effects[i].effect;
    const Effect* effect = find_effect(name);
    if (effect == nullptr) continue;
    if (on_samples(data) && has_no_shape(fit, *effect))
      return fmt::format("the records do not determine most of the parameters of {}", name);
    for (const ParameterInfo& info : effect->parameters()) {
      const int k = find_parameter(*fit.model, name, info.symbol);
      if (k < 0 || std::isnan(info.absent)) continue;
      const double value = fit.theta[static_cast<std::size_t>(k)];
      if (value != info.absent && fit.at_bound(k) &&
          !(errors == Errors::noise && ended_by_chance(fit, data, k, info.absent)))
        return fmt::format("{} of {} ended at {:.4g} {}, the end of what is physically admissible",
                           info.symbol, name, value, info.unit);
    }
    if (is_off(fit, i))
      return fmt::format("{} was switched off by the fit: its sign would not be admissible", name);
  }
  return {};
}

}  // namespace

double pull(const HarmonicFit& fit, const std::vector<RunDatum>& data, int parameter) {
  const auto at = std::find(fit.free.begin(), fit.free.end(), parameter) - fit.free.begin();
  if (at == static_cast<std::ptrdiff_t>(fit.free.size())) return 0.0;
  const Eigen::VectorXd along =
      stacked_jacobian(fit, data, fit.free).transpose() * stacked_residual(fit, data);
  return fit.covariance.row(at).dot(along) / fit.standard_error(parameter);
}

const HarmonicFit& rounded(const Hypothesis& h) {
  return h.rounded ? *h.rounded : *h.fit;
}

void Refits::know_left(const Hypothesis& h) {
  if (h.disqualified.empty()) least_left_ = std::min(least_left_, h.fit->chi_squared);
}

Hypothesis Refits::with(const Hypothesis& smaller, const Probe& probe) const {
  const HarmonicFit& parent = rounded(smaller);
  Hypothesis h;
  h.effects = smaller.effects;
  h.effects.push_back(probe.line.effect);
  std::sort(h.effects.begin(), h.effects.end());
  const auto spec = with_line(parent.spec, probe.line);
  h.fit = begun_at_forces(spec, parent);
  if (!h.fit) h.fit = refitted(spec, carried_over(Model(spec), parent), &parent);
  // A fit with one effect more that is worse ended in a valley on its way. The fit of a record is
  // too expensive to be repeated.
  if (!on_samples(data_) && std::isfinite(h.fit->chi_squared) &&
      h.fit->chi_squared > parent.chi_squared)
    h.fit = begun_apart(std::move(h.fit), parent, probe);
  finish(h);
  return h;
}

// A base model far above noise has bent to imitate what is missing, maybe into a valley from which no
// effect leads away. The forces along the measured motion show where the valley with the effect is.
// Null where they lead to nothing better than the fit without it.
std::shared_ptr<const HarmonicFit> Refits::begun_at_forces(const config::ModelSpec& spec,
                                                           const HarmonicFit& parent) const {
  if (!on_samples(data_) || !is_far_above_noise(base_)) return nullptr;
  const auto start = fitted_to_forces(spec, data_, {}, options_);
  if (start.empty()) return nullptr;
  FitOptions look = options_for(spec);
  look.max_iterations = 0;
  const HarmonicFit there = fit_harmonics(spec, data_, start, nullptr, look);
  if (!(there.chi_squared < parent.chi_squared)) return nullptr;
  return refitted(spec, start, &there);
}

// Forces along the measured motion hardly have valleys between the parameters, so the fit starts
// there. If that is no better than without the effect, it starts from much lower and much higher
// values too, unless the first fit came by there. Along an imposed motion a few steps show whether
// such a start leads anywhere near. Returns the best fit.
std::shared_ptr<const HarmonicFit> Refits::begun_apart(std::shared_ptr<const HarmonicFit> best,
                                                       const HarmonicFit& parent,
                                                       const Probe& probe) const {
  const std::vector<config::EffectSpec> lines = placed_apart(probe);
  if (lines.empty()) return best;
  const auto take = [&](const config::ModelSpec& spec, const std::vector<double>& start) {
    auto fit = refitted(spec, start, &parent);
    if (fit->chi_squared < best->chi_squared) best = std::move(fit);
  };
  const auto near = with_line(parent.spec, probe.line);
  const std::shared_ptr<const HarmonicFit> first = best;
  const auto start = fitted_to_forces(near, data_, carried_over(Model(near), parent), options_);
  if (!start.empty()) take(near, start);
  for (const config::EffectSpec& line : lines) {
    if (best->chi_squared <= parent.chi_squared) break;
    const bool forces = along_motion(data_);  // of responses a way along a bound tells little
    if (forces && went_past(*first, line)) continue;
    const auto apart = with_line(parent.spec, line);
    auto from = carried_over(Model(apart), parent);
    if (forces) {
      FitOptions quick = options_for(apart);
      quick.points = options_.points / kQuickShare;
      quick.max_iterations = kQuickSteps;
      const HarmonicFit look = fit_harmonics(apart, data_, from, &parent, quick);
      if (!(look.chi_squared < kNearBest * best->chi_squared)) continue;
      from = look.theta;
    }
    take(apart, from);
  }
  return best;
}

std::optional<Hypothesis> Refits::elsewhere(const Probe& probe, double most) const {
  FitOptions quick = options_;
  quick.points /= kQuickShare;
  quick.max_iterations = kQuickSteps;
  std::shared_ptr<const HarmonicFit> best;
  const auto look = [&](const config::ModelSpec& spec, const std::vector<double>& start) {
    auto fit = std::make_shared<HarmonicFit>(fit_harmonics(spec, data_, start, &base_, quick));
    if (fit->chi_squared < (best ? best->chi_squared : most)) best = std::move(fit);
  };
  const std::vector<config::EffectSpec> lines = starts_of(probe);
  for (const config::EffectSpec& line : lines) {
    const auto spec = with_line(base_.spec, line);
    look(spec, carried_over(Model(spec), base_));
  }
  const auto spec = with_line(base_.spec, lines.front());
  const auto start = fitted_to_forces(spec, data_, carried_over(Model(spec), base_), options_);
  if (!start.empty()) look(spec, start);
  if (!best) return std::nullopt;
  Hypothesis h;
  h.effects = {probe.line.effect};
  h.fit = refitted(best->spec, best->theta, best.get());
  finish(h);
  return h;
}

std::optional<std::size_t> Refits::switched_off(const Hypothesis& h) const {
  for (std::size_t line = first_added(); line < h.fit->spec.effects.size(); ++line) {
    if (is_off(*h.fit, line)) return line;
  }
  return std::nullopt;
}

void Refits::judge(Hypothesis& h) const {
  h.disqualified = disqualification(*h.fit, h.data ? *h.data : data_, first_added(), errors_);
}

void Refits::finish(Hypothesis& h) const {
  for (std::size_t line = h.fit->spec.effects.size(); line-- > first_added();)
    centre(h, line);
  judge(h);
  if (std::isfinite(h.fit->chi_squared)) describe(h);
}

Hypothesis Refits::without(const Hypothesis& larger, std::size_t line) const {
  const HarmonicFit& parent = rounded(larger);
  Hypothesis h;
  h.effects = larger.effects;
  std::erase(h.effects, parent.spec.effects[line].effect);
  config::ModelSpec spec = parent.spec;
  spec.effects.erase(spec.effects.begin() + static_cast<std::ptrdiff_t>(line));
  h.fit = refitted(spec, carried_over(Model(spec), parent), &parent);
  judge(h);
  if (std::isfinite(h.fit->chi_squared)) describe(h);
  return h;
}

Hypothesis Refits::with_instead(const Hypothesis& known, const std::string& effect,
                                const config::EffectSpec& other) const {
  const HarmonicFit& parent = rounded(known);
  Hypothesis h;
  h.effects = known.effects;
  std::replace(h.effects.begin(), h.effects.end(), effect, other.effect);
  std::sort(h.effects.begin(), h.effects.end());
  config::ModelSpec spec = parent.spec;
  const auto line = std::find_if(spec.effects.rbegin(), spec.effects.rend(),
                                 [&](const auto& own) { return own.effect == effect; });
  *line = other;
  h.fit = refitted(spec, carried_across(Model(spec), other.effect, parent, effect), nullptr);
  finish(h);
  return h;
}

Hypothesis Refits::again(const Hypothesis& known) const {
  Hypothesis h;
  h.effects = known.effects;
  h.fit = refitted(rounded(known).spec, known.fit->theta, &rounded(known));
  judge(h);
  if (std::isfinite(h.fit->chi_squared)) describe(h);
  narrow_as(known, h);
  return h;
}

void Refits::describe(Hypothesis& h) const {
  const int constants =
      count_of_places(h.fit->spec, first_added(), range_of(data_)) + (h.fit->constant ? 1 : 0);
  h.added = constants + static_cast<int>(h.fit->free.size() - base_.free.size());
  const std::vector<RunDatum>& data = h.data ? *h.data : data_;
  h.log_evidence = log_evidence(*h.fit, data, h.added);
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role != Role::fit) continue;
    h.log_evidence -= log_scale(data[r]) - log_scale(data_[r]);
  }
  h.cross_validated = cross_validate(*h.fit, data);
}

std::shared_ptr<const HarmonicFit> Refits::refitted(const config::ModelSpec& spec,
                                                    const std::vector<double>& start,
                                                    const HarmonicFit* near) const {
  const FitOptions fine = options_for(spec);
  const auto fitted = [&](const std::vector<double>& from, const HarmonicFit* of,
                          const FitOptions& options) {
    return std::make_shared<const HarmonicFit>(fit_harmonics(spec, data_, from, of, options));
  };
  // Most iterations use a coarse grid, on which a step costs a fraction. But the wide smoothing of
  // a coarse grid leads elsewhere, and a memory needs all points. A fit that used all its
  // iterations on both grids would creep from the start too, so it is not repeated.
  std::shared_ptr<const HarmonicFit> fit;
  if (!has_edges(spec) && !on_samples(data_)) {
    FitOptions coarse = fine;
    coarse.points /= has_smoothing(spec) ? kMemoryShare : kQuickShare;
    const auto rough = fitted(start, near, coarse);
    if (std::isfinite(rough->chi_squared)) fit = fitted(rough->theta, rough.get(), fine);
    if (fit && (fit->converged || fit->iterations >= fine.max_iterations)) return fit;
  }
  auto direct = fitted(start, near, fine);
  if (fit && fit->chi_squared < direct->chi_squared) return fit;
  if (!std::isfinite(direct->chi_squared) || !can_jump(spec, data_)) return direct;
  const auto jumping = fit_of_jumps(*direct, data_, fine);
  return jumping && jumping->chi_squared < direct->chi_squared ? jumping : direct;
}

// Models with memory are compared on half the points, and get narrower smoothing when it matters. A
// record has no grid.
FitOptions Refits::options_for(const config::ModelSpec& spec) const {
  FitOptions wanted = options_;
  wanted.sharp = true;
  wanted.at_once = false;
  // Fits of records are dear. A corner leaves much until it jumps.
  if (on_samples(data_) && !has_edges(spec)) wanted.hopeless = kNowhereNear * least_left_;
  const Model model(spec);
  if (model.coordinates() > model.mechanical()) {
    if (!on_samples(data_)) wanted.points /= 2;
    wanted.max_iterations = kMemorySteps;
  }
  return wanted;
}

}  // namespace shaker::estimator::diagnosis
