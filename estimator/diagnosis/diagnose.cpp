#include "estimator/diagnosis/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/diagnosis/cycles/harmonics.hpp"
#include "estimator/diagnosis/fit/smoothing.hpp"
#include "estimator/diagnosis/motion_range.hpp"
#include "estimator/diagnosis/noise/above_noise.hpp"
#include "estimator/diagnosis/noise/excitation_noise.hpp"
#include "estimator/diagnosis/noise/extra_channels.hpp"
#include "estimator/diagnosis/noise/screening.hpp"
#include "estimator/diagnosis/noise/transient.hpp"
#include "estimator/diagnosis/noise/weighing.hpp"
#include "estimator/diagnosis/report/estimates.hpp"
#include "estimator/diagnosis/report/model_probabilities.hpp"
#include "estimator/diagnosis/report/read_effects.hpp"
#include "estimator/diagnosis/report/stated.hpp"
#include "estimator/diagnosis/searches.hpp"
#include "estimator/diagnosis/select/selection.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::VectorXd;

constexpr double kMinRestartGain = 5.0;  // times what is left a datum: less is chance
constexpr double kUsualRuns = 6.0;
constexpr std::size_t kSpeeds =
    10000;                        // of a run: enough for its cycles, too few to show its noise
constexpr int kRecordSteps = 40;  // of a fit: each integrates every sample
// Of records, in budgets of periodic runs: what their search may take, and one more for so many
// samples; in points: what one fit may take, and for each sample.
constexpr double kRecordBudget = 4.0, kSamplesOfBudget = 250.0;
constexpr double kFitBudget = 8e6, kFitBudgetOfSample = 2500.0;
constexpr int kRecordDraws = 1500;  // of noise: a record has many times as many data as a cycle

Error invalid(std::string why) {
  return {ErrorKind::invalid, std::move(why)};
}

// Without a fit of the base model there is nothing to compare with.
Error not_fitted(const HarmonicFit& fit) {
  return {ErrorKind::not_converged,
          fit.trouble +
              "; nothing can be said of what is missing before the model itself is fitted: "
              "give start values nearer to the damper's (shakerctl estimate tries several), "
              "fix what these runs cannot determine, or look for a channel with coarse "
              "steps or a wrong scale"};
}

Result<void> check(const Campaign& campaign, const DiagnoseOptions& options) {
  if (campaign.runs.empty()) return invalid("the campaign has no run");
  if (!(options.false_alarm_rate > 0.0 && options.false_alarm_rate < 0.5))
    return invalid(fmt::format("a false-alarm rate of {} makes no sense; it is between 0 and 0.5",
                               options.false_alarm_rate));
  if (!(options.evaluation_budget > 0.0))
    return invalid(
        fmt::format("an effort of {} allows no search; it is above 0", options.evaluation_budget));
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

// Two runs that were driven alike and answered differently cannot both be right.
Result<void> agree(const std::vector<RunDatum>& data, HarmonicFit& fit) {
  for (std::size_t a = 0; a < data.size(); ++a) {
    for (std::size_t b = a + 1; b < data.size(); ++b) {
      const auto size = std::min(data[a].driver.size(), data[b].driver.size());
      const VectorXd drive = data[b].driver.head(size) - data[a].driver.head(size);
      if (std::fabs(data[a].frequency_hz / data[b].frequency_hz - 1.0) > 2e-3 ||
          drive.norm() > 0.02 * data[a].driver.norm())
        continue;
      const auto shared = std::min(data[a].response.size(), data[b].response.size());
      const Eigen::MatrixXd slope =
          fit.predictions[a].over_excitation(static_cast<int>((size - 1) / 2));
      const VectorXd expected = slope.topRows(shared) * drive.tail(size - 1);
      const VectorXd apart =
          data[b].response.head(shared) - data[a].response.head(shared) - expected;
      const VectorXd error = (data[a].error.head(shared).cwiseAbs2() +
                              data[b].error.head(shared).cwiseAbs2() + 1e-3 * expected.cwiseAbs2())
                                 .cwiseSqrt();
      const double distance = apart.cwiseQuotient(error).squaredNorm();
      const auto n = static_cast<double>(shared);
      if (distance < n + 12.0 * std::sqrt(2.0 * n)) continue;
      return invalid(fmt::format(
          "runs {} and {} contradict each other: driven alike at {:.4g} Hz, they answer {:.2g} "
          "standard errors apart; something changed between them (temperature, gas charge, the "
          "sensor's mounting): repeat one of them or leave one out",
          data[a].name, data[b].name, data[a].frequency_hz, std::sqrt(distance / n)));
    }
  }
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

// From start values that are far off the base model's fit may end in a valley of its own, and any
// effect mends that: fitted again from what it is with the effects that were named. Nothing where
// that is no better, beside what the model leaves in any case: a fit far from noise ends a little
// lower or higher in the same valley.
std::optional<config::ModelSpec> better_start(const config::ModelSpec& model,
                                              const std::vector<double>& theta, double left,
                                              const std::vector<RunDatum>& data,
                                              const Diagnosis& said, const FitOptions& options) {
  if (said.effects.empty()) return std::nullopt;
  std::vector<double> start = theta;
  const Model base(model);
  for (std::size_t k = 0; k < start.size(); ++k) {
    for (const ParameterEstimate& after : said.parameters_after) {
      if (after.name == base.parameters()[k].name && after.effect == base.parameters()[k].effect)
        start[k] = after.value;
    }
  }
  const HarmonicFit fit = fit_harmonics(model, data, start, nullptr, options);
  const double a_datum = std::max(1.0, fit.chi_squared / std::max(1, fit.observations));
  if (!fit.converged || left - fit.chi_squared < kMinRestartGain * a_datum) return std::nullopt;
  return at_estimates(fit);
}

// What could not be scored stands behind what could not be computed. A drift and a grid are read
// from the records: where they are named, they were tried.
void tell_not_tried(const std::vector<NotTried>& not_tried, Diagnosis& said) {
  for (const NotTried& n : not_tried) {
    if (std::none_of(said.effects.begin(), said.effects.end(),
                     [&](const NamedEffect& e) { return e.name == n.name; }))
      said.not_tried.push_back(n);
  }
}

// What is sure comes first: a drift is read from the records.
void put_sure_first(Diagnosis& said) {
  std::stable_partition(said.effects.begin(), said.effects.end(),
                        [](const NamedEffect& e) { return e.probability > kMostUnexplained; });
}

// Whether what was said after a new beginning is to stand: it explains more, or leaves less.
bool says_more(const Diagnosis& anew, const Diagnosis& first) {
  const auto explains = [](const Diagnosis& d) { return d.verdict != Verdict::unexplained; };
  if (explains(anew) != explains(first)) return explains(anew);
  return explains(anew) || anew.gap.after < first.gap.after;
}

void tell_if_cut_short(Diagnosis& said) {
  if (said.cut_short)
    said.warnings.push_back(
        "the search stopped at its limit of work, though more could be tried: shakerctl diagnose "
        "--thorough goes on");
}

SelectionOptions selection_for(const DiagnoseOptions& options, const FitOptions& fitting) {
  SelectionOptions selection;
  selection.fit = fitting;
  selection.most_effects = options.most_effects;
  selection.false_alarm_rate = options.false_alarm_rate;
  selection.draws = options.draws;
  selection.seed = options.seed;
  selection.calibrations = options.calibrations;
  return selection;
}

Result<Diagnosis> diagnose_cycles(const Campaign& campaign, const config::ModelSpec& model,
                                  const DiagnoseOptions& options, const Progress& progress,
                                  const std::shared_ptr<EvaluationBudget>& budget,
                                  bool may_begin_anew = true) {
  progress("cutting cycles", 0.0);
  const FitOptions fitting{options.points};
  FitOptions first = fitting;
  first.from_rest = true;
  auto looked = screen_campaign(campaign, model, first);
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
  const std::string unit = campaign.runs.front().kind == Kind::imposed_motion
                               ? model.length_unit + "/s^2"
                               : model.length_unit;
  std::vector<double> motions;
  for (std::size_t r = 0; r < runs.size(); ++r)
    motions.push_back(motion_of(runs[r].mean().head(weighed.data[r].error.size())));
  if (auto good = above_noise(weighed.data, motions, unit, warnings); !good) return good.error();
  HarmonicFit base = fit_harmonics(model, weighed.data, rough.theta, nullptr, first);
  if (!base.trouble.empty()) return not_fitted(base);
  if (campaign.runs.front().kind == Kind::periodic) {
    if (auto good = agree(weighed.data, base); !good) return good.error();
    auto more = extra_channels(runs, base, weighed.data, warnings);
    if (!more.empty()) {
      weighed.data.insert(weighed.data.end(), more.begin(), more.end());
      base = fit_harmonics(model, weighed.data, base.theta, nullptr, first);
      if (!base.trouble.empty()) return not_fitted(base);
    }
  }

  const auto catalogue =
      candidates(model, range_of(weighed.data), campaign.runs.front().kind, warnings);
  const SelectionOptions selection = selection_for(options, fitting);
  progress("scoring the catalogue", 0.2);
  const std::vector<double> theta = base.theta;
  const double left = base.chi_squared;
  Diagnosis said =
      searched(std::move(base), weighed.data, runs, catalogue.tried, selection, progress);
  if (may_begin_anew) {
    if (const auto better = better_start(model, theta, left, weighed.data, said, first)) {
      auto anew = diagnose_cycles(campaign, *better, options, progress, budget, false);
      if (anew && says_more(*anew, said)) return anew;
      said.cut_short = said.cut_short || (anew && anew->cut_short);
    }
  }
  said.campaign = campaign.name;
  said.false_alarm_rate = options.false_alarm_rate;
  said.gap.unit = unit;
  said.warnings.insert(said.warnings.begin(), warnings.begin(), warnings.end());
  warn_of_design(runs, weighed.variance_inflation, said);
  tell_if_cut_short(said);
  name_read_effects(*looked, weighed.coarseness, said);
  put_sure_first(said);
  tell_not_tried(catalogue.not_tried, said);
  progress("done", 1.0);
  return said;
}

// Lets the records share a budget; returns how a model is fitted to them.
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
  // With a larger budget for the whole, a fit that creeps has no more.
  const double usual = DiagnoseOptions{}.evaluation_budget;
  fitting.fit_budget = std::min(1.0, options.evaluation_budget / usual) *
                       (kFitBudget + kFitBudgetOfSample * samples);
  return fitting;
}

// A campaign of runs that are not periodic.
Result<Diagnosis> diagnose_records(const Campaign& campaign, const config::ModelSpec& model,
                                   const DiagnoseOptions& options, const Progress& progress) {
  progress("reading records", 0.0);
  auto runs = transient_runs(campaign.runs, model);
  if (!runs) return runs.error();
  const Kind kind = campaign.runs.front().kind;
  progress("fitting the model", 0.05);
  const FitOptions fitting = bounded(*runs, options);
  HarmonicFit base = fit_transient(model, *runs, fitting);
  if (!base.trouble.empty() || !std::isfinite(base.chi_squared)) return not_fitted(base);
  if (auto good = use_repetitions(*runs, base); !good) return good.error();
  // Twice: how the response follows the excitation depends on the fit.
  const std::vector<RunDatum> own = runs->data;
  for (int round = 0; round < 2; ++round) {
    const bool counted = count_excitation_noise(*runs, own, base);
    base = fit_harmonics(model, runs->data, base.theta, nullptr, fitting);
    if (!base.trouble.empty()) return not_fitted(base);
    if (!counted) break;
  }
  const std::string unit = runs->by_force ? model.length_unit + "/s^2" : model.length_unit;
  std::vector<double> motions;
  for (const RunDatum& datum : runs->data)
    motions.push_back(motion_of(datum.response));
  if (auto good = above_noise(runs->data, motions, unit, runs->warnings); !good)
    return good.error();
  const auto catalogue = shown_by_transients(
      candidates(model, range_of(runs->data), kind, runs->warnings), model, runs->by_force);
  SelectionOptions selection = selection_for(options, fitting);
  selection.draws = std::min(options.draws, kRecordDraws);
  progress("scoring the catalogue", 0.2);
  const std::vector<SteadyRun> none(runs->data.size());
  Diagnosis said =
      searched(std::move(base), runs->data, none, catalogue.tried, selection, progress);
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
  put_sure_first(said);
  tell_not_tried(catalogue.not_tried, said);
  progress("done", 1.0);
  return said;
}

double budget_of(const Campaign& campaign, const DiagnoseOptions& options) {
  return options.evaluation_budget *
         std::max(1.0, static_cast<double>(campaign.runs.size()) / kUsualRuns);
}

// Root mean square speed of the strokes that were recorded, times the square root of two; of the run
// in which it is largest. Rough: what noise adds is not taken off.
double swiftest(const Campaign& campaign) {
  double speed = 0.0;
  for (const Recording& run : campaign.runs) {
    const std::size_t n = std::min(run.t.size(), run.displacement.size());
    const std::size_t stride = std::max<std::size_t>(1, n / kSpeeds);
    double square = 0.0;
    std::size_t count = 0;
    for (std::size_t i = stride; i < n; i += stride) {
      const double v =
          (run.displacement[i] - run.displacement[i - stride]) / (run.t[i] - run.t[i - stride]);
      if (!std::isfinite(v)) continue;
      square += v * v;
      ++count;
    }
    if (count > 0) speed = std::max(speed, std::sqrt(2.0 * square / static_cast<double>(count)));
  }
  return speed;
}

bool periodic(const Recording& run) {
  return run.kind == Kind::periodic || (run.kind == Kind::imposed_motion && run.frequency_hz > 0.0);
}

}  // namespace

Result<Diagnosis> diagnose(const Campaign& campaign, const config::ModelSpec& model,
                           const DiagnoseOptions& options, const Progress& progress) {
  if (auto good = check(campaign, options); !good) return good.error();
  const Progress report = progress ? progress : [](std::string_view, double) {};
  try {
    // A file whose friction turns round at once leaves the width to the grids.
    const config::ModelSpec freed = sharp_freed(model, swiftest(campaign));
    // Sines and earthquakes on one dynamometer: all of them as records.
    auto said =
        std::all_of(campaign.runs.begin(), campaign.runs.end(), periodic)
            ? diagnose_cycles(campaign, freed, options, report,
                              std::make_shared<EvaluationBudget>(budget_of(campaign, options)))
            : diagnose_records(campaign, freed, options, report);
    if (!said) return said;
    hold_against_file(model, *said);
    said->damper.campaign = said->campaign;
    if (!said->damper.hypotheses.empty())
      said->damper.hypotheses.front().model = with_narrow_smoothing(said->improved);
    return said;
  } catch (const std::invalid_argument& error) {
    return invalid(error.what());
  }
}

}  // namespace shaker::estimator::diagnosis
