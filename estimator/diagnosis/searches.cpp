#include "estimator/diagnosis/internal/searches.hpp"

#include <algorithm>
#include <functional>
#include <optional>
#include <utility>

#include "estimator/diagnosis/noise/internal/run_constants.hpp"
#include "estimator/diagnosis/report/internal/assemble.hpp"
#include "estimator/diagnosis/report/internal/model_probabilities.hpp"
#include "estimator/diagnosis/select/internal/evidence.hpp"
#include "estimator/diagnosis/select/internal/model_error.hpp"
#include "estimator/diagnosis/select/internal/unknown_colour.hpp"
#include "estimator/diagnosis/select/internal/weighed_again.hpp"
#include "estimator/diagnosis/select/internal/weights.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// Shares of the budget that each search leaves for the later ones: the search with errors from
// noise, from the best hypothesis, and by shares of the gap. A search does not begin with less than
// kEnough above its share.
constexpr double kLeftByNoise = 0.5, kLeftByOwn = 0.08, kLeftByGap = 0.1, kEnough = 0.1;

// About the constants of the round before: what is not straight in them is far below noise then.
constexpr int kConstantsRounds = 3;

// In words after `but`, and for predictions: a drop is one more run.
void tell_constants(const std::string& but, const RunConstants& constants, const HarmonicFit& fit,
                    const std::vector<RunDatum>& data, Diagnosis& said) {
  const std::string& length = fit.spec.length_unit;
  const std::string force = length + "/s^2";
  const bool forces = data.front().kind == Kind::imposed_motion || data.front().by_force;
  said.damper.spread = {constants.force, constants.gas_pressure, constants.damping};
  said.warnings.push_back(but + constants.words(forces ? force : length, force));
}

Diagnosis said_of_colour(const OfUnknownColour& of, const std::vector<SteadyRun>& runs,
                         const std::vector<Candidate>& catalogue) {
  Diagnosis said = assemble(of.found, of.data, runs, catalogue, of.data);
  if (of.constants) tell_constants("", *of.constants, *of.found.base.fit, of.data, said);
  said.warnings.push_back(
      "what is left is more than the noise above the response, but follows neither stroke nor "
      "velocity nor any effect of the catalogue: it is taken for noise of low frequency; two "
      "records of one excitation would show whether it is");
  return said;
}

// Evidence of a fit with run constants, comparable with that of a hypothesis: each standard
// deviation counts as a fitted parameter.
double evidence_of(const HarmonicFit& fit, const WithRunConstants& with,
                   const std::vector<RunDatum>& data) {
  double evidence = log_evidence(fit, with.data, with.constants.count());
  for (std::size_t r = 0; r < data.size(); ++r) {
    if (data[r].role == Role::fit) evidence -= log_scale(with.data[r]) - log_scale(data[r]);
  }
  return evidence;
}

// Tries whether the runs only differ in their zero, preload, gas pressure or damping. Returns a
// diagnosis if nothing else is missing and that is more probable than what the search found.
// Otherwise it is what "nothing" weighs against the names.
std::optional<Diagnosis> said_of_run_constants(Selection& searched,
                                               const std::vector<RunDatum>& data,
                                               const std::vector<SteadyRun>& runs,
                                               const std::vector<Candidate>& catalogue,
                                               const SelectionOptions& options) {
  if (searched.adequate) return std::nullopt;
  const HarmonicFit& base = *searched.base.fit;
  const std::vector<RunDatum>& fitted = searched.base.data ? *searched.base.data : data;
  auto with = with_run_constants(base, fitted, data, options.fit);
  HarmonicFit again;
  for (int round = 0; round < kConstantsRounds; ++round) {
    if (!with || (!searched.explained && !beyond_chance(with->constants))) return std::nullopt;
    for (RunDatum& datum : with->data)
      datum.budget =
          std::make_shared<EvaluationBudget>();  // a fixed amount: the searches keep theirs
    again = fit_harmonics(base.spec, with->data, base.theta, &base, options.fit);
    if (!again.trouble.empty()) return std::nullopt;
    if (round + 1 < kConstantsRounds)
      with = with_run_constants(again, data, data, options.fit, &*with);
  }
  const Selection found = judge(std::move(again), with->data, catalogue, options);
  if (!found.adequate) return std::nullopt;
  const Weights weights(searched, data);
  const double nothing = weights.log_of_runs_that_differ(evidence_of(*found.base.fit, *with, data));
  if (searched.explained && weights.log_of_effects() >= nothing) {
    searched.base.log_evidence = std::max(searched.base.log_evidence, nothing);
    return std::nullopt;
  }
  Diagnosis said = assemble(found, with->data, runs, catalogue, with->data);
  tell_constants("nothing else is missing, but ", with->constants, base, data, said);
  return said;
}

// The diagnosis of a search by shares of the gap. Its verdict stays `unexplained`.
Diagnosis said_of_gap(Selection by_gap, const Selection& first,
                      const std::vector<RunDatum>& softened, const std::vector<RunDatum>& data,
                      const std::vector<SteadyRun>& runs, const std::vector<Candidate>& catalogue,
                      const FitOptions& options) {
  by_gap.adequate = by_gap.explained = false;
  by_gap.probability_base = first.probability_base;
  by_gap.probability_best = first.probability_best;
  // Chooses by the runs that the report shows, as assemble does.
  const auto shown = static_cast<std::ptrdiff_t>(runs.size());
  if (const auto answer = answer_of(by_gap, {softened.begin(), softened.begin() + shown}))
    take_to_zero_width(by_gap, *answer, softened, options);
  Diagnosis said = assemble(by_gap, softened, runs, catalogue, data);
  said.chi_squared_before = first.base.fit->chi_squared;
  if (catalogue.empty()) return said;
  said.warnings.push_back(
      "the model is far from the data even with the best that the catalogue offers: effects "
      "are weighed by the share of the gap that they close, and not by the noise");
  return said;
}

// Options of a search after the first one: it starts from the first one's solutions.
SelectionOptions after(const Selection& first, SelectionOptions selection, double leave) {
  selection.leave = leave;
  selection.probed = first.base_scoring.probed;
  return selection;
}

// What a search has found is not lost where the next one is cut short: its answer, unless that is a
// single effect. These are all tried anyway.
std::optional<Hypothesis> known_of(const Selection& found, const std::vector<RunDatum>& data) {
  const auto answer = answer_of(found, data);
  if (!answer || found.hypotheses[*answer].effects.size() < 2) return std::nullopt;
  return found.hypotheses[*answer];
}

Diagnosis said_of_own_errors(const WeighedAgain& again, const std::vector<SteadyRun>& runs,
                             const std::vector<Candidate>& catalogue, const Progress& progress) {
  progress("drawing up", 0.95);
  Diagnosis said = assemble(again.found, again.data, runs, catalogue, again.data);
  if (!again.differ.empty()) said.warnings.push_back(again.differ);
  return said;
}

// Maps the progress of a search to the part from `from` to `to` of the whole.
std::function<void(double)> naming_between(const Progress& progress, double from, double to) {
  return [&progress, from, to](double share) { progress("naming", from + (to - from) * share); };
}

// True if too little of the budget is left to begin a search that must leave the share `leave`.
bool is_late(const std::vector<RunDatum>& data, double leave) {
  const auto& budget = data.front().budget;
  return budget && budget->leaves_less_than(leave + kEnough);
}

}  // namespace

Diagnosis searched(HarmonicFit base, const std::vector<RunDatum>& data,
                   const std::vector<SteadyRun>& runs, const std::vector<Candidate>& catalogue,
                   const SelectionOptions& selection, const Progress& progress) {
  const auto named = [&](double from, double to) { return naming_between(progress, from, to); };
  const config::ModelSpec spec = base.spec;
  const std::vector<double> theta = base.theta;
  SelectionOptions by_noise = selection;
  by_noise.leave = kLeftByNoise;
  Selection first = select_effects(std::move(base), data, catalogue, by_noise, named(0.2, 0.6));
  if (const auto coloured = nothing_but_colour(first, data, catalogue, selection))
    return said_of_colour(*coloured, runs, catalogue);
  if (const auto coloured =
          explained_but_for_colour(first, data, catalogue, selection, named(0.6, 0.9)))
    return said_of_colour(*coloured, runs, catalogue);
  if (first.explained) {
    if (auto said = said_of_run_constants(first, data, runs, catalogue, selection)) return *said;
  }
  const Hypothesis* guide = guide_of(first, data);
  if (guide != nullptr && is_late(data, kLeftByOwn)) {
    first.cut_short = true;
  } else if (guide != nullptr) {
    const SelectionOptions own = after(first, selection, kLeftByOwn);
    if (const auto again = explained_by_own_errors(*guide, *first.base.fit, runs, data, catalogue,
                                                   own, named(0.6, 0.9), first.cut_short))
      return said_of_own_errors(*again, runs, catalogue, progress);
  }
  if (!first.explained) {
    if (auto said = said_of_run_constants(first, data, runs, catalogue, selection)) return *said;
  }
  const auto softened = with_model_error(first, data);
  if (softened && is_late(data, kLeftByGap)) {
    first.cut_short = true;
  } else if (softened) {
    HarmonicFit again = fit_harmonics(spec, *softened, theta, first.base.fit.get(), selection.fit);
    if (again.trouble.empty()) {
      const auto known = known_of(first, data);
      SelectionOptions by_gap = after(first, selection, kLeftByGap);
      by_gap.by_gap = true;
      by_gap.known = known ? &*known : nullptr;
      first.hypotheses.clear();  // with their solutions: they take memory
      Selection second =
          select_effects(std::move(again), *softened, catalogue, by_gap, named(0.6, 0.9));
      if (!second.hypotheses.empty())  // what a round corner leaves is not the noise's
        take_to_zero_width(second, second.best, *softened, selection.fit);
      progress("drawing up", 0.95);
      second.cut_short = second.cut_short || first.cut_short;
      return said_of_gap(std::move(second), first, *softened, data, runs, catalogue, selection.fit);
    }
  }
  progress("drawing up", 0.95);
  return assemble(first, data, runs, catalogue, data);
}

}  // namespace shaker::estimator::diagnosis
