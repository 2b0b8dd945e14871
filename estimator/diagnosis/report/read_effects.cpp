#include "estimator/diagnosis/report/internal/read_effects.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "estimator/diagnosis/cycles/internal/quantisation_step.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/diagnosis/report/internal/estimates.hpp"
#include "estimator/diagnosis/report/internal/gaps.hpp"
#include "estimator/math/statistics.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kCoarse = 1.0;             // against the noise: more governs the floor
constexpr double kGridProbability = 0.999;  // that a grid is one

bool holds(const config::ModelSpec& model, std::string_view effect) {
  return std::any_of(model.effects.begin(), model.effects.end(),
                     [&](const config::EffectSpec& line) { return line.effect == effect; });
}

// What a root mean square loses when it becomes another.
double part_of(double larger, double smaller) {
  return std::sqrt(std::max(0.0, larger * larger - smaller * smaller));
}

// Named by its only parameter, which is in `unit`.
NamedEffect named(std::string_view effect, const std::string& unit, double value,
                  double standard_error, double quantile) {
  const Effect& known = *find_effect(effect);
  NamedEffect one;
  one.name = std::string(known.name());
  one.meaning = std::string(known.meaning());
  one.formula = std::string(known.formula());
  ParameterEstimate p;
  p.name = std::string(known.parameters()[0].symbol);
  p.effect = one.name;
  p.unit = unit;
  p.value = value;
  p.standard_error = standard_error;
  p.lower = value - quantile * standard_error;
  p.upper = value + quantile * standard_error;
  one.parameters.push_back(std::move(p));
  return one;
}

// Slow changes of the gas move the mean as well; of another model, whatever has the parameter.
std::vector<std::string> slow_changes(const std::string& rival, const HarmonicFit& fit) {
  if (rival.empty()) return {};
  for (const ModelParameter& p : fit.model->parameters()) {
    if (p.name != rival) continue;
    if (p.effect == "gas_spring") return {"gas_heat_transfer", "dissolved_gas"};
    return {p.effect};
  }
  return {};
}

NamedEffect drift_named(const Screening& first, const std::string& unit) {
  const ZeroDrift& drift = first.drift;
  NamedEffect one = named("sensor_drift", unit + "/s", drift.rate, drift.standard_error,
                          student_t_quantile(0.975, std::max(drift.freedom, 1.0)));
  one.probability = drift.probability;
  one.confusable_with = slow_changes(drift.rival, first.look.fit);
  one.where =
      fmt::format("in every cycle: the mean moves by {:.3g} {} a minute and its shape stays",
                  60.0 * drift.rate, unit);
  if (!drift.common) one.where += "; the runs' rates differ, and each has its own taken out";
  return one;
}

// The gap that there was with the drift in the records, and what it did to the parameters.
void tell_before(const Look& look, Diagnosis& said) {
  if (!look.fitted()) return;
  Diagnosis raw;
  const Fitted fitted{look.fit, look.weighed.data};
  tell_gaps(fitted, fitted, look.weighed.data, look.weighed.data, look.runs, raw);
  said.gap.before = raw.gap.before;
  if (said.gap.held_out_before) said.gap.held_out_before = raw.gap.held_out_before;
  for (RunGap& run : said.runs) {
    for (const RunGap& before : raw.runs) {
      if (before.name == run.name) run.before = before.before;
    }
  }
  said.parameters_before = describe(look.fit, look.weighed.data);
}

// The larger part of the gap is named first: what the search found closes `closed`, the effect moves
// the response by `moves`, both root mean square.
void add(NamedEffect effect, double gain, double moves, double closed, Diagnosis& said) {
  Ranked ranked;
  ranked.name = effect.name;
  ranked.gain = gain;
  ranked.probability = effect.probability;
  const auto behind = std::find_if(said.ranking.begin(), said.ranking.end(), [&](const Ranked& r) {
    return r.probability < ranked.probability;
  });
  said.ranking.insert(behind, std::move(ranked));
  said.parameters_after.push_back(effect.parameters.front());
  said.effects.insert(moves > closed ? said.effects.begin() : said.effects.end(),
                      std::move(effect));
}

void name_drift(const Screening& first, const std::string& unit, double closed, Diagnosis& said) {
  NamedEffect effect = drift_named(first, unit);
  const double without = said.gap.before;
  tell_before(*first.with_drift, said);
  const double moves = part_of(said.gap.before, without);
  said.probability_before = std::min(said.probability_before, first.drift.chance);
  if (said.gap.held_out_before && said.gap.held_out_after)
    effect.held_out_gain = 1.0 - *said.gap.held_out_after / *said.gap.held_out_before;
  config::EffectSpec line;
  line.effect = effect.name;
  line.parameters[effect.parameters[0].name].start = first.drift.rate;
  said.improved.effects.push_back(std::move(line));
  add(std::move(effect), std::pow(first.drift.rate / first.drift.standard_error, 2), moves, closed,
      said);
}

// The coarsest grid of the runs.
double quantisation_step_in(const std::vector<SteadyRun>& runs) {
  double coarsest = 0.0;
  for (const SteadyRun& run : runs)
    coarsest = std::max(coarsest, run.quantisation_step);
  return coarsest;
}

void name_grid(double quantisation_step, const std::string& effect_of_it, const std::string& unit,
               double closed, Diagnosis& said) {
  NamedEffect effect = named("sensor_quantisation", unit, quantisation_step, 0.0, 0.0);
  effect.probability = kGridProbability;
  effect.where = fmt::format("in every sample: all stand on steps of {:.4g} {}, {}",
                             quantisation_step, unit, effect_of_it);
  add(std::move(effect), 0.0, quantisation_step / std::sqrt(12.0), closed, said);
  said.warnings.push_back(
      "the displacement sensor's steps are too coarse for the noise to blur them: what they may do "
      "is in the noise floor, and nothing in the model mends it; what moves less than that cannot "
      "be seen");
}

// With no more named than what the records show, an adequate model is one that lacks that.
void settle_verdict(Diagnosis& said) {
  if (said.verdict != Verdict::adequate) return;
  said.verdict = said.gap.after > kExplainedGap * said.gap.noise_floor ? Verdict::unexplained
                                                                       : Verdict::explained;
}

}  // namespace

void name_read_effects(const Screening& first, double coarseness, Diagnosis& said) {
  const config::ModelSpec& model = first.look.fit.spec;
  const std::size_t before = said.effects.size();
  const double closed = part_of(said.gap.before, said.gap.after);
  if (first.with_drift && !holds(model, "sensor_drift"))
    name_drift(first, model.length_unit, closed, said);
  const double quantisation_step = quantisation_step_in(first.look.runs);
  if (coarseness > kCoarse && first.look.runs.front().kind == Kind::periodic &&
      !holds(model, "sensor_quantisation"))
    name_grid(
        quantisation_step,
        fmt::format("which moves a mean cycle {:.2g} times as much as the noise does", coarseness),
        model.length_unit, closed, said);
  if (said.effects.size() > before) settle_verdict(said);
}

void name_grid_of_records(const std::vector<Recording>& recordings,
                          const std::vector<RunDatum>& data, Diagnosis& said) {
  if (holds(said.improved, "sensor_quantisation")) return;
  double coarsest = 0.0, coarseness = 0.0;
  for (const RunDatum& datum : data) {
    const auto run = std::find_if(recordings.begin(), recordings.end(), [&](const Recording& r) {
      return datum.sampled->record == r.name;
    });
    if (datum.by_force || run == recordings.end()) continue;
    const double quantisation_step = quantisation_step_of(run->displacement);
    const double rounding = quantisation_step * quantisation_step / 12.0;
    // The spectrum's noise includes the rounding.
    const double rest = std::max(datum.sampled->sample_noise - rounding, 1e-6 * rounding);
    coarsest = std::max(coarsest, quantisation_step);
    if (rounding > 0.0) coarseness = std::max(coarseness, std::sqrt(rounding / rest));
  }
  if (!(coarseness > kCoarse)) return;
  name_grid(coarsest, "which are more than the noise", said.improved.length_unit,
            part_of(said.gap.before, said.gap.after), said);
  settle_verdict(said);
}

}  // namespace shaker::estimator::diagnosis
