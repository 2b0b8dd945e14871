#include "estimator/diagnosis/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/internal/fit_records.hpp"
#include "estimator/diagnosis/internal/inputs.hpp"
#include "estimator/diagnosis/internal/motion_range.hpp"
#include "estimator/diagnosis/internal/searches.hpp"
#include "estimator/diagnosis/noise/internal/above_noise.hpp"
#include "estimator/diagnosis/noise/internal/agreement.hpp"
#include "estimator/diagnosis/noise/internal/extra_channels.hpp"
#include "estimator/diagnosis/noise/internal/first_fit.hpp"
#include "estimator/diagnosis/noise/internal/own_forces.hpp"
#include "estimator/diagnosis/noise/internal/run_constants.hpp"
#include "estimator/diagnosis/noise/internal/screening.hpp"
#include "estimator/diagnosis/noise/internal/transient.hpp"
#include "estimator/diagnosis/noise/internal/weighing.hpp"
#include "estimator/diagnosis/report/internal/estimates.hpp"
#include "estimator/diagnosis/report/internal/model_probabilities.hpp"
#include "estimator/diagnosis/report/internal/read_effects.hpp"
#include "estimator/diagnosis/report/internal/stated.hpp"
#include "estimator/diagnosis/select/internal/selection.hpp"
#include "estimator/model/effects/scaled.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kUsualRuns = 6.0;
constexpr int kRecordSteps = 40;  // of a fit: each integrates every sample
// For records. In units of the budget of periodic runs: the share of a search, and the number of
// samples that adds one more. In points: the budget of one fit, and its increase for each sample.
constexpr double kRecordBudget = 4.0, kSamplesOfBudget = 250.0;
constexpr double kFitBudget = 8e6, kFitBudgetOfSample = 2500.0;
constexpr int kRecordDraws = 1500;  // of noise: a record has many times as many data as a cycle

Error invalid(std::string why) {
  return {ErrorKind::invalid, std::move(why)};
}

Result<void> check(const Campaign& campaign, const DiagnoseOptions& options) {
  if (campaign.runs.empty()) return invalid("the campaign has no run");
  if (!(options.false_alarm_rate > 0.0 && options.false_alarm_rate < 0.5))
    return invalid(fmt::format("a false-alarm rate of {} makes no sense; it is between 0 and 0.5",
                               options.false_alarm_rate));
  if (!(options.evaluation_budget > 0.0))
    return invalid(fmt::format("an evaluation budget of {} allows no search; it must be above 0",
                               options.evaluation_budget));
  for (const Recording& run : campaign.runs) {
    if (run.kind != campaign.runs.front().kind)
      return invalid(fmt::format("runs {} and {} are of different kinds; diagnose them apart",
                                 campaign.runs.front().name, run.name));
  }
  if (std::none_of(campaign.runs.begin(), campaign.runs.end(),
                   [](const Recording& r) { return r.role == Role::fit; }))
    return invalid("every run is held out; at least one must have the role \"fit\"");
  return {};
}

void warn_of_design(const std::vector<SteadyRun>& runs, double variance_inflation,
                    Diagnosis& said) {
  const auto fitted =
      std::count_if(runs.begin(), runs.end(), [](const auto& r) { return r.role == Role::fit; });
  if (runs.size() == 1)
    said.warnings.push_back(
        "there is one run only: what is said holds at its frequency and amplitude, several effects "
        "look alike there, and nothing can be held out");
  else if (fitted == 1)
    said.warnings.push_back("only one run is fitted; the others are held out");
  if (std::any_of(runs.begin(), runs.end(), [](const auto& r) { return !r.driver_measured; }))
    said.warnings.push_back(
        "the excitation was not measured: delays and distortion of the exciter look like the "
        "damper's");
  if (variance_inflation > 1.0)
    said.warnings.push_back(
        fmt::format("the noise is correlated from cycle to cycle: means are {:.1f} times as "
                    "uncertain as their scatter says, which is taken into account",
                    std::sqrt(variance_inflation)));
}

// Appends the effects that could not be scored to those that could not be computed. Drift and
// quantisation are read from the records: if they are named, they were tried.
void tell_not_tried(const std::vector<NotTried>& not_tried, Diagnosis& said) {
  for (const NotTried& n : not_tried) {
    if (std::none_of(said.effects.begin(), said.effects.end(),
                     [&](const NamedEffect& e) { return e.name == n.name; }))
      said.not_tried.push_back(n);
  }
}

void tell_if_cut_short(Diagnosis& said) {
  if (said.cut_short)
    said.warnings.push_back(
        "the search stopped at its limit of work, though more could be tried: shakerctl diagnose "
        "--thorough goes on");
}

SelectionOptions selection_for(const DiagnoseOptions& options, const FitOptions& fitting,
                               const Campaign& campaign) {
  SelectionOptions selection;
  selection.refits *= 1 + static_cast<int>(campaign.inputs.size());  // as the catalogue is longer
  selection.fit = fitting;
  selection.most_effects = options.most_effects;
  selection.false_alarm_rate = options.false_alarm_rate;
  selection.draws = options.draws;
  selection.seed = options.seed;
  selection.calibrations = options.calibrations;
  return selection;
}

// The catalogue, or an empty one if no effect may be added: then the answer is about the model as
// it is.
Catalogue tried_by(const DiagnoseOptions& options, const config::ModelSpec& model,
                   const MotionRange& range, const Campaign& campaign,
                   const std::vector<RunDatum>& data, std::vector<std::string>& warnings) {
  if (options.most_effects == 0) return {};
  return candidates(model, range, campaign.runs.front().kind, warnings, inputs_of(campaign, data));
}

// Fits the model to the stroke, and then again: with the further channels, which it appends to
// `data`; with a zero of each run's own, where a motion is imposed and they differ.
Result<HarmonicFit> fit_all_channels(const config::ModelSpec& model, Kind kind,
                                     const std::vector<SteadyRun>& runs,
                                     const std::vector<double>& start, const FitOptions& options,
                                     std::vector<RunDatum>& data,
                                     std::vector<std::string>& warnings) {
  HarmonicFit base = fit_harmonics(model, data, start, nullptr, options);
  if (!serves(base)) return not_fitted(base);
  if (kind != Kind::periodic) {
    std::string differ = let_zeros_differ(base, model.length_unit + "/s^2", data);
    if (differ.empty()) return base;
    warnings.push_back(std::move(differ));
    base = fit_harmonics(model, data, base.theta, &base, options);
    if (!serves(base)) return not_fitted(base);
    return base;
  }
  if (auto good = check_agreement(data, base); !good) return good.error();
  auto more = extra_channels(runs, base, data, warnings);
  if (more.empty()) return base;
  data.insert(data.end(), more.begin(), more.end());
  base = fit_harmonics(model, data, base.theta, nullptr, options);
  if (!serves(base)) return not_fitted(base);
  return base;
}

Result<Diagnosis> diagnose_cycles(const Campaign& campaign, const config::ModelSpec& stated,
                                  const DiagnoseOptions& options, const Progress& progress,
                                  const std::shared_ptr<EvaluationBudget>& budget) {
  progress("cutting cycles", 0.0);
  const FitOptions fitting{options.points};
  FitOptions first = fitting;
  first.from_rest = true;
  auto looked = screen_campaign(campaign, stated, first);
  if (!looked) return looked.error();
  std::vector<SteadyRun>& runs = looked->look.runs;
  HarmonicFit& rough = looked->look.fit;
  std::vector<std::string> warnings = campaign.warnings;
  warnings.insert(warnings.end(), looked->warnings.begin(), looked->warnings.end());
  progress("fitting the model", 0.1);
  if (!looked->look.fitted()) return not_fitted(rough);
  Weighed weighed = weigh(runs, rough);
  for (RunDatum& datum : weighed.data)
    datum.budget = budget;
  const MotionRange range = range_of(weighed.data);
  const config::ModelSpec model = with_room(stated, scale_of(range));
  const std::string unit = campaign.runs.front().kind == Kind::imposed_motion
                               ? model.length_unit + "/s^2"
                               : model.length_unit;
  std::vector<double> motions;
  for (std::size_t r = 0; r < runs.size(); ++r)
    motions.push_back(motion_of(runs[r].mean().head(weighed.data[r].error.size())));
  if (auto good = above_noise(weighed.data, motions, unit, warnings); !good) return good.error();
  auto fitted = fit_all_channels(model, campaign.runs.front().kind, runs, rough.theta, first,
                                 weighed.data, warnings);
  if (!fitted) return fitted.error();
  HarmonicFit& base = *fitted;
  warn_if_unsettled(base, warnings);

  const auto catalogue = tried_by(options, model, range, campaign, weighed.data, warnings);
  const SelectionOptions selection = selection_for(options, fitting, campaign);
  progress("scoring the catalogue", 0.2);
  Diagnosis said =
      searched(std::move(base), weighed.data, runs, catalogue.tried, selection, progress);
  said.campaign = campaign.name;
  said.false_alarm_rate = options.false_alarm_rate;
  said.gap.unit = unit;
  said.warnings.insert(said.warnings.begin(), warnings.begin(), warnings.end());
  warn_of_design(runs, weighed.variance_inflation, said);
  tell_if_cut_short(said);
  warn_of_bounds(said);
  name_read_effects(*looked, weighed.coarseness, said);
  tell_not_tried(catalogue.not_tried, said);
  progress("done", 1.0);
  return said;
}

// Gives the records one common budget, and returns the options of a fit to them.
FitOptions bounded(TransientRuns& runs, const DiagnoseOptions& options) {
  double samples = 0.0;
  for (const RunDatum& datum : runs.data)
    samples += static_cast<double>(datum.sampled->samples());
  const auto budget = std::make_shared<EvaluationBudget>(
      options.evaluation_budget * (kRecordBudget + samples / kSamplesOfBudget));
  for (auto* data : {&runs.data, &runs.forces}) {
    for (RunDatum& datum : *data)
      datum.budget = budget;
  }
  FitOptions fitting{options.points};
  fitting.max_iterations = kRecordSteps;
  // A larger budget for the whole diagnosis gives no more to a single fit that creeps.
  const double usual = DiagnoseOptions{}.evaluation_budget;
  fitting.fit_budget = std::min(1.0, options.evaluation_budget / usual) *
                       (kFitBudget + kFitBudgetOfSample * samples);
  return fitting;
}

// Diagnoses a campaign of runs without a period.
Result<Diagnosis> diagnose_records(const Campaign& campaign, const config::ModelSpec& stated,
                                   const DiagnoseOptions& options, const Progress& progress) {
  progress("reading records", 0.0);
  auto runs = transient_runs(campaign.runs, stated);
  if (!runs) return runs.error();
  const MotionRange range = range_of(runs->data);
  const config::ModelSpec model = with_room(stated, scale_of(range));
  progress("fitting the model", 0.05);
  FitOptions fitting = bounded(*runs, options);
  const std::string unit = runs->by_force ? model.length_unit + "/s^2" : model.length_unit;
  auto fitted = fit_records(model, unit, range.force, fitting, *runs);
  if (!fitted) return fitted.error();
  fitting.sharp = fitting.at_once = fitted->base.at_once;
  std::vector<double> motions;
  for (const RunDatum& datum : runs->data)
    motions.push_back(motion_in(datum));
  if (auto good = above_noise(runs->data, motions, unit, runs->warnings); !good)
    return good.error();
  const auto catalogue = shown_by_transients(
      tried_by(options, model, range, campaign, runs->data, runs->warnings), model, *runs);
  SelectionOptions selection = selection_for(options, fitting, campaign);
  selection.draws = std::min(options.draws, kRecordDraws);
  progress("scoring the catalogue", 0.2);
  const std::vector<SteadyRun> none(runs->data.size());
  Diagnosis said =
      searched(std::move(fitted->base), runs->data, none, catalogue.tried, selection, progress);
  if (fitted->own_forces) take_out(*fitted->own_forces, said);
  said.campaign = campaign.name;
  said.false_alarm_rate = options.false_alarm_rate;
  said.gap.unit = unit;
  said.warnings.insert(said.warnings.begin(), runs->warnings.begin(), runs->warnings.end());
  said.warnings.insert(said.warnings.begin(), campaign.warnings.begin(), campaign.warnings.end());
  if (std::any_of(campaign.runs.begin(), campaign.runs.end(), [](const Recording& r) {
        return !r.acceleration.empty() || (r.kind == Kind::transient && !r.force.empty());
      }))
    said.warnings.push_back(
        "the channels acceleration and force are not used: they are for runs with a period");
  name_grid_of_records(campaign.runs, runs->data, said);
  if (runs->data.size() == 1)
    said.warnings.push_back("there is one run only, and nothing can be held out");
  tell_if_cut_short(said);
  warn_of_bounds(said);
  tell_not_tried(catalogue.not_tried, said);
  progress("done", 1.0);
  return said;
}

double budget_of(const Campaign& campaign, const DiagnoseOptions& options) {
  return options.evaluation_budget *
         std::max(1.0, static_cast<double>(campaign.runs.size()) / kUsualRuns);
}

bool periodic(const Recording& run) {
  return run.kind == Kind::periodic || (run.kind == Kind::imposed_motion && run.frequency_hz > 0.0);
}

}  // namespace

Result<Diagnosis> diagnose(const Campaign& recorded, const config::ModelSpec& stated,
                           const DiagnoseOptions& options, const Progress& progress) {
  if (auto good = check(recorded, options); !good) return good.error();
  const Campaign campaign = with_common_conditions(recorded, stated);
  const auto known = with_run_values(with_references(stated, campaign), campaign);
  if (!known) return known.error();
  const config::ModelSpec& model = *known;
  const Progress report = progress ? progress : [](std::string_view, double) {};
  try {
    // If the file states that a friction reverses at once, the grids choose the width.
    const config::ModelSpec freed = sharp_freed(model, swiftest(campaign));
    // If one run of a dynamometer has no period, all its runs are treated as records.
    auto said =
        std::all_of(campaign.runs.begin(), campaign.runs.end(), periodic)
            ? diagnose_cycles(campaign, freed, options, report,
                              std::make_shared<EvaluationBudget>(budget_of(campaign, options)))
            : diagnose_records(campaign, freed, options, report);
    if (!said) return said;
    hold_against_file(model, *said);
    said->damper.campaign = said->campaign;
    return said;
  } catch (const std::invalid_argument& error) {
    return invalid(error.what());
  }
}

}  // namespace shaker::estimator::diagnosis
