#include "cli/diagnosed_drop.hpp"

#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/heap.hpp"
#include "cli/diagnosed_data.hpp"
#include "cli/joined_drop.hpp"
#include "cli/opened_campaign.hpp"
#include "estimator/diagnosis/diagnose.hpp"
#include "estimator/drop/falling_damper.hpp"
#include "report/damper_document.hpp"

namespace shaker::cli {
namespace {

Result<estimator::IdentifiedDamper> diagnosed_now(const DropOptions& options,
                                                  std::vector<std::string>& warnings) {
  keep_freed_memory();
  auto opened = open_campaigns(options.campaigns, options.model);
  if (!opened) return opened.error();
  using estimator::diagnosis::CalibrationCache;
  CalibrationCache calibrations(CalibrationCache::user_folder());
  estimator::diagnosis::DiagnoseOptions wanted;
  wanted.calibrations = &calibrations;
  auto found = estimator::diagnosis::diagnose(opened->campaign, opened->model, wanted);
  if (!found) return found.error();
  warnings.insert(warnings.end(), found->warnings.begin(), found->warnings.end());
  return std::move(found->damper);
}

// The conditions of the first hypothesis that has a drop.
Result<DropSetup> set_up_for(const DropOptions& options,
                             const estimator::IdentifiedDamper& damper) {
  auto setup = set_up_drop(options, estimator::without_instruments(damper.hypotheses[0]).model);
  for (std::size_t h = 1; h < damper.hypotheses.size(); ++h) {
    if (setup || setup.error().kind != ErrorKind::not_converged) break;
    setup = set_up_drop(options, estimator::without_instruments(damper.hypotheses[h]).model);
  }
  return setup;
}

}  // namespace

PredictedDrop DiagnosedDrop::predicted() const {
  PredictedDrop predicted;
  predicted.history = &drop.run.history;
  predicted.band = drop.history;
  for (const estimator::MixtureBand& band : drop.bands)
    predicted.figures.push_back({band.value, band.lower, band.upper});
  return predicted;
}

Result<estimator::IdentifiedDamper> damper_for(const DropOptions& options,
                                               std::vector<std::string>& warnings) {
  for (const auto& place : options.campaigns) {
    if (auto good = expect_campaign(place); !good) return good.error();
  }
  if (options.diagnosis.empty()) return diagnosed_now(options, warnings);
  auto damper = report::read_damper(options.diagnosis);
  if (!damper) return damper;
  if (auto good = expect_origin(*damper, options.diagnosis, options.campaigns); !good)
    return good.error();
  return damper;
}

namespace {

void put_joined(JoinedPrediction joined, DiagnosedDrop& out) {
  if (!joined.drop.intervals_hold)
    out.drop.warnings.emplace_back(
        "the measured drop disagrees with the likeliest hypothesis by more than noise explains: "
        "the "
        "intervals do not hold");
  out.joined = std::move(joined);
}

// Puts the measured drop into the estimate and predicts again.
Result<void> join_measured(const DropOptions& options, DiagnosedDrop& out) {
  const auto& conditions = out.output.sections.setup.conditions;
  const auto record = joining_record(options, *out.output.measured, out.length);
  if (!record) return record.error();
  auto joined = estimator::join_drop(out.damper, conditions, *record);
  if (!joined)
    return Error{joined.error().kind,
                 fmt::format("{}: {}", options.measured.string(), joined.error().what)};
  auto after = estimator::predict_drop(joined->damper, conditions, mixture_options(options));
  if (!after) return Error{ErrorKind::not_converged, after.error().what};
  put_joined({std::move(*joined), std::move(*after)}, out);
  return {};
}

Result<DiagnosedDrop> predict_one(const DropOptions& options,
                                  const estimator::IdentifiedDamper& damper) {
  auto setup = set_up_for(options, damper);
  if (!setup) return setup.error();
  DiagnosedDrop out;
  out.output.sections.setup = std::move(*setup);
  out.length = damper.hypotheses.front().model.length_unit;
  out.damper = out.output.sections.setup.falling(damper);
  const estimator::MixtureOptions how = mixture_options(options);
  out.priors = how.priors;
  auto drop = estimator::predict_drop(out.damper, out.output.sections.setup.conditions, how);
  if (!drop) return Error{ErrorKind::not_converged, drop.error().what};
  out.drop = std::move(*drop);
  if (const auto& rule = out.output.sections.setup.rule; rule && !rule->remark.empty())
    out.drop.warnings.push_back(rule->remark);
  out.output.sections.banded = true;
  const auto within = [&](std::size_t f, double limit) {
    return out.drop.probability_within(f, limit);
  };
  // The hypothesis to which the curve belongs.
  Error last;
  for (const auto& hypothesis : out.damper.hypotheses) {
    const auto model = estimator::without_instruments(hypothesis).model;
    auto done = complete(options, {model, &out.damper, out.predicted(), within}, out.output);
    if (done && options.join) done = join_measured(options, out);
    if (done) return out;
    last = done.error();
    if (last.kind != ErrorKind::not_converged) break;
  }
  return last;
}

// The options of the measured drop, where it fell otherwise than the predicted one.
Result<std::optional<DropOptions>> options_of_measured(const DropOptions& options) {
  if (!options.measured_sink_speed && !options.measured_lift && !options.measured_mass)
    return std::optional<DropOptions>();
  const bool by_rule = !options.rule.empty();
  DropOptions own = options;
  own.rule = own.condition = own.weight = own.wing_loading = "";
  own.limits.clear();
  for (auto* range : {&own.charge, &own.oil, &own.temperature})
    if (range->size() == 2) range->clear();
  own.piston_area.reset();
  const auto choose = [&](const std::optional<double>& measured, std::optional<double>& value) {
    if (measured || by_rule) value = measured;
  };
  choose(options.measured_sink_speed, own.sink_speed);
  choose(options.measured_lift, own.lift);
  choose(options.measured_mass, own.mass);
  if (!own.shaker_mass) own.shaker_mass = options.mass;
  own.measured_sink_speed = own.measured_lift = own.measured_mass = std::nullopt;
  if (by_rule && (!own.sink_speed || !own.mass))
    return Error{
        ErrorKind::invalid,
        "with a rule, a measured drop under other conditions needs --measured-sink-speed and "
        "--measured-mass"};
  return std::optional(std::move(own));
}

// What the measured drop says of `out`, which falls otherwise.
Result<void> carry_over(const DropOptions& options, const DiagnosedDrop& measured,
                        DiagnosedDrop& out) {
  if (!measured.joined) return {};
  const DropSetup& setup = out.output.sections.setup;
  const double ratio = setup.ratio / measured.output.sections.setup.ratio;
  if (setup.tyre && setup.mass != measured.output.sections.setup.mass)
    return Error{ErrorKind::invalid,
                 "--join: with a tyre, the measured drop must have the mass of the predicted one"};
  JoinedPrediction joined = *measured.joined;
  joined.drop.damper = estimator::with_mass(joined.drop.damper, ratio);
  auto after =
      estimator::predict_drop(joined.drop.damper, setup.conditions, mixture_options(options));
  if (!after) return Error{ErrorKind::not_converged, after.error().what};
  joined.after = std::move(*after);
  put_joined(std::move(joined), out);
  return {};
}

}  // namespace

Result<DiagnosedDrop> predict_diagnosed(const DropOptions& options,
                                        const estimator::IdentifiedDamper& damper) {
  const auto own = options_of_measured(options);
  if (!own) return own.error();
  if (!*own) return predict_one(options, damper);
  auto measured = predict_one(**own, damper);
  if (!measured) return measured.error();
  DropOptions rest = options;
  rest.measured.clear();
  rest.join = false;
  auto out = predict_one(rest, damper);
  if (!out) return out.error();
  if (auto done = carry_over(options, *measured, *out); !done) return done.error();
  out->measured_fall = std::make_shared<const DiagnosedDrop>(std::move(*measured));
  return out;
}

std::string name_of(const estimator::DamperHypothesis& h) {
  return h.effects.empty() ? "nothing is missing" : fmt::format("{}", fmt::join(h.effects, " + "));
}

}  // namespace shaker::cli
