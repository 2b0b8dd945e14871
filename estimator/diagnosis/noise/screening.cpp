#include "estimator/diagnosis/noise/internal/screening.hpp"

#include <cmath>

#include "estimator/diagnosis/cycles/internal/plausibility.hpp"
#include "estimator/diagnosis/noise/internal/first_fit.hpp"
#include "estimator/diagnosis/noise/internal/wrong_unit.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kSameZero = 10.0;  // of chi-squared a run, that starting at zero may cost
constexpr double kStart = 0.002;    // of the drift so far: a start that is not quite the record's

Result<Look> look_at(const Campaign& campaign, const config::ModelSpec& model,
                     const FitOptions& options, const Drifts& drifts,
                     std::vector<std::string>& warnings) {
  auto runs = cut_campaign(campaign, drifts, warnings);
  if (!runs) return runs.error();
  if (auto good = plausible(*runs, model, warnings); !good) return good.error();
  Weighed weighed = weigh(*runs);
  HarmonicFit fit = first_fit(model, weighed.data, options);
  Look look{std::move(*runs), std::move(weighed), std::move(fit)};
  if (auto good = in_one_unit(look, model, options, warnings); !good) return good.error();
  return look;
}

void fit_again(const config::ModelSpec& model, const FitOptions& options, Look& look) {
  look.weighed = weigh(look.runs);
  look.fit = first_fit(model, look.weighed.data, options);
}

// Where a zero that drifts stood when a record began is not known: where it has gone since the
// campaign's first record, if their times go on from one to the next.
void forget_zeros(std::vector<SteadyRun>& runs) {
  bool one_clock = runs.size() > 1;
  for (std::size_t r = 1; r < runs.size(); ++r)
    one_clock = one_clock && runs[r].recorded_at > runs[r - 1].recorded_at;
  for (SteadyRun& run : runs) {
    const double before = one_clock ? run.recorded_at - runs.front().recorded_at : 0.0;
    run.zero_error = std::fabs(run.drift_taken) * (before + run.when.mean());
  }
}

void trust_zeros(std::vector<SteadyRun>& runs, double standard_error) {
  for (SteadyRun& run : runs)
    run.zero_error =
        std::hypot(standard_error, kStart * std::fabs(run.drift_taken)) * run.when.mean();
}

// A zero that was right when each record began tells more of the mean stroke, and is taken for
// that where the means do not object.
void place_zeros(const config::ModelSpec& model, const FitOptions& options, double standard_error,
                 Look& look) {
  Look trusting{look.runs, {}, {}};
  trust_zeros(trusting.runs, standard_error);
  fit_again(model, options, trusting);
  forget_zeros(look.runs);
  fit_again(model, options, look);
  if (!trusting.fitted()) return;
  const auto runs = static_cast<double>(look.runs.size());
  if (!look.fitted() || trusting.fit.chi_squared < look.fit.chi_squared + kSameZero * runs)
    look = std::move(trusting);
}

}  // namespace

bool Look::fitted() const {
  return serves(fit);
}

Result<Screening> screen_campaign(const Campaign& campaign, const config::ModelSpec& model,
                                  const FitOptions& options) {
  Screening first;
  auto look = look_at(campaign, model, options, {}, first.warnings);
  if (!look) return look.error();
  first.look = std::move(*look);
  if (campaign.runs.front().kind != Kind::periodic) return first;
  first.drift = zero_drift(first.look.runs, first.look.fitted() ? &first.look.fit : nullptr);
  if (!first.drift.instead.empty()) first.warnings.push_back(first.drift.instead);
  if (!first.drift.found) return first;
  // Without it more cycles are steady, and tell it better.
  Drifts drifts;
  for (const Recording& run : campaign.runs) {
    const auto own = first.drift.of_run.find(run.name);
    drifts[run.name] = own != first.drift.of_run.end() ? own->second : first.drift.rate;
  }
  std::vector<std::string> discarded;
  auto runs = cut_campaign(campaign, drifts, discarded);
  if (!runs) return runs.error();
  const ZeroDrift rest = zero_drift(*runs, nullptr);
  first.drift.rate += rest.rate;
  first.drift.standard_error = rest.standard_error;
  first.drift.freedom = rest.freedom;
  for (auto& [name, rate] : drifts) {
    const auto own = rest.of_run.find(name);
    rate += first.drift.common || own == rest.of_run.end() ? rest.rate : own->second;
  }
  first.drift.of_run = drifts;
  first.warnings.clear();
  auto without = look_at(campaign, model, options, drifts, first.warnings);
  if (!without) return without.error();
  first.with_drift = std::move(first.look);
  first.look = std::move(*without);
  place_zeros(model, options, first.drift.standard_error, first.look);
  return first;
}

}  // namespace shaker::estimator::diagnosis
