#include "estimator/discrepancy/name/unknown_colour.hpp"

#include <algorithm>
#include <utility>

#include "estimator/discrepancy/weigh/noise_colour.hpp"

namespace shaker::estimator::discrepancy {
namespace {

bool along_motion(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                  const NamingOptions& options) {
  const auto chance = chance_along_motion(fit, data, options.fit);
  return !chance || *chance <= options.false_alarm_rate;
}

std::vector<ColourOf> possible(const std::vector<RunDatum>& data) {
  const bool of_excitation = std::any_of(data.begin(), data.end(),
                                         [](const RunDatum& d) { return d.whitening != nullptr; });
  if (!of_excitation) return {ColourOf::response};
  return {ColourOf::response, ColourOf::excitation};
}

// The model of `spec` judged with the spectrum that `left` leaves, once it is fitted to that;
// nothing where more is missing than noise.
std::optional<OfUnknownColour> without_force(const HarmonicFit& left,
                                             const std::vector<RunDatum>& fitted,
                                             const std::vector<RunDatum>& data, ColourOf of,
                                             const std::vector<Candidate>& catalogue,
                                             const NamingOptions& options) {
  OfUnknownColour out;
  out.data = with_spectrum_left(left, fitted, data, of);
  HarmonicFit again = fit_harmonics(left.spec, out.data, left.theta, &left, options.fit);
  if (!again.trouble.empty() || along_motion(again, out.data, options)) return std::nullopt;
  out.found = judge(std::move(again), out.data, catalogue, options);
  if (!out.found.adequate) return std::nullopt;
  return out;
}

}  // namespace

std::optional<OfUnknownColour> nothing_but_colour(const Naming& judged,
                                                  const std::vector<RunDatum>& data,
                                                  const std::vector<Candidate>& catalogue,
                                                  const NamingOptions& options) {
  if (judged.adequate || !data.front().sampled) return std::nullopt;
  for (const ColourOf of : possible(data)) {
    if (auto found = without_force(*judged.base.fit, data, data, of, catalogue, options))
      return found;
  }
  return std::nullopt;
}

std::optional<OfUnknownColour> explained_but_for_colour(
    const Naming& searched, const std::vector<RunDatum>& data,
    const std::vector<Candidate>& catalogue, const NamingOptions& options,
    const std::function<void(double)>& progress) {
  if (searched.adequate || searched.explained || !data.front().sampled ||
      searched.best >= searched.hypotheses.size())
    return std::nullopt;
  const Hypothesis& left = searched.hypotheses[searched.best];
  if (!left.disqualified.empty()) return std::nullopt;
  const HarmonicFit& base = *searched.base.fit;
  for (const ColourOf of : possible(data)) {
    auto out =
        without_force(*left.fit, left.data ? *left.data : data, data, of, catalogue, options);
    if (!out) continue;
    HarmonicFit again = fit_harmonics(base.spec, out->data, base.theta, &base, options.fit);
    if (!again.trouble.empty()) continue;
    out->found = name_effects(std::move(again), out->data, catalogue, options, progress);
    if (!out->found.explained) continue;
    const Hypothesis& best = out->found.hypotheses[out->found.best];
    if (!along_motion(*best.fit, best.data ? *best.data : out->data, options)) return out;
  }
  return std::nullopt;
}

}  // namespace shaker::estimator::discrepancy
