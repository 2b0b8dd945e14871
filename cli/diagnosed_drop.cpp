#include "cli/diagnosed_drop.hpp"

#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/heap.hpp"
#include "cli/opened_campaign.hpp"
#include "estimator/discrepancy/diagnose.hpp"
#include "report/damper_document.hpp"

namespace shaker::cli {
namespace {

Result<estimator::IdentifiedDamper> diagnosed_now(const DropOptions& options) {
  keep_freed_memory();
  auto opened = open_campaigns(options.campaigns, options.model);
  if (!opened) return opened.error();
  using estimator::discrepancy::CalibrationCache;
  CalibrationCache calibrations(CalibrationCache::user_folder());
  estimator::discrepancy::DiagnoseOptions wanted;
  wanted.calibrations = &calibrations;
  auto found = estimator::discrepancy::diagnose(opened->campaign, opened->model, wanted);
  if (!found) return found.error();
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

Result<estimator::IdentifiedDamper> damper_for(const DropOptions& options) {
  for (const auto& place : options.campaigns) {
    if (auto good = expect_campaign(place); !good) return good.error();
  }
  return options.diagnosis.empty() ? diagnosed_now(options)
                                   : report::read_damper(options.diagnosis);
}

Result<DiagnosedDrop> predict_diagnosed(const DropOptions& options,
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
  out.output.sections.banded = true;
  const auto within = [&](std::size_t f, double limit) {
    return out.drop.probability_within(f, limit);
  };
  // The hypothesis to which the curve belongs.
  Error last;
  for (const auto& hypothesis : out.damper.hypotheses) {
    const auto model = estimator::without_instruments(hypothesis).model;
    auto done = complete(options, {model, &out.damper, out.predicted(), within}, out.output);
    if (done) return out;
    last = done.error();
    if (last.kind != ErrorKind::not_converged) break;
  }
  return last;
}

std::string name_of(const estimator::DamperHypothesis& h) {
  return h.effects.empty() ? "nothing is missing" : fmt::format("{}", fmt::join(h.effects, " + "));
}

}  // namespace shaker::cli
