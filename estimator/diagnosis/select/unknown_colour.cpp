#include "estimator/diagnosis/select/unknown_colour.hpp"

#include <algorithm>
#include <utility>

#include "estimator/diagnosis/noise/noise_colour.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kChosenByChance = 1e-7;  // three effects of some forty may be chosen

const Hypothesis* best_of(const Selection& found) {
  if (found.best >= found.hypotheses.size()) return nullptr;
  const Hypothesis& best = found.hypotheses[found.best];
  return best.disqualified.empty() ? &best : nullptr;
}

bool along_motion(const HarmonicFit& fit, const std::vector<RunDatum>& data,
                  const SelectionOptions& options) {
  const auto chance = chance_along_motion(fit, data, options.fit);
  return !chance || *chance <= options.false_alarm_rate;
}

// True if the best hypothesis leaves far less than the base model: by more than choosing among all
// sets of the catalogue gains by chance.
bool closed_by_effects(const Selection& searched, const std::vector<RunDatum>& data) {
  const Hypothesis* best = best_of(searched);
  if (best == nullptr) return false;
  const HarmonicFit& base = *searched.base.fit;
  const double gain = spectrum_gain(*best->fit, base, data);
  const auto more = static_cast<double>(best->fit->free.size() - base.free.size());
  return more > 0.0 && chi_squared_above(std::max(gain, 0.0), more) < kChosenByChance;
}

std::vector<ColourOf> possible(const std::vector<RunDatum>& data) {
  const bool of_excitation = std::any_of(data.begin(), data.end(),
                                         [](const RunDatum& d) { return d.whitening != nullptr; });
  if (!of_excitation) return {ColourOf::response};
  return {ColourOf::response, ColourOf::excitation};
}

// Fits the model of `left` again, with its residual as the spectrum of the noise. Empty if more
// than noise is missing.
std::optional<OfUnknownColour> without_force(const HarmonicFit& left,
                                             const std::vector<RunDatum>& fitted,
                                             const std::vector<RunDatum>& data, ColourOf of,
                                             const std::vector<Candidate>& catalogue,
                                             const SelectionOptions& options) {
  if (!may_be_noise(left, fitted)) return std::nullopt;
  OfUnknownColour out;
  out.data = with_spectrum_left(left, fitted, data, of);
  HarmonicFit again = fit_harmonics(left.spec, out.data, left.theta, &left, options.fit);
  if (!again.trouble.empty() || along_motion(again, out.data, options)) return std::nullopt;
  out.found = judge(std::move(again), out.data, catalogue, options);
  if (!out.found.adequate) return std::nullopt;
  return out;
}

}  // namespace

std::optional<OfUnknownColour> nothing_but_colour(const Selection& searched,
                                                  const std::vector<RunDatum>& data,
                                                  const std::vector<Candidate>& catalogue,
                                                  const SelectionOptions& options) {
  if (searched.adequate || searched.explained || !on_samples(data) ||
      closed_by_effects(searched, data))
    return std::nullopt;
  for (const ColourOf of : possible(data)) {
    if (auto found = without_force(*searched.base.fit, data, data, of, catalogue, options))
      return found;
  }
  return std::nullopt;
}

std::optional<OfUnknownColour> explained_but_for_colour(
    const Selection& searched, const std::vector<RunDatum>& data,
    const std::vector<Candidate>& catalogue, const SelectionOptions& options,
    const std::function<void(double)>& progress) {
  const Hypothesis* best = best_of(searched);
  if (searched.adequate || searched.explained || !on_samples(data) || best == nullptr)
    return std::nullopt;
  const HarmonicFit& base = *searched.base.fit;
  for (const ColourOf of : possible(data)) {
    auto out =
        without_force(*best->fit, best->data ? *best->data : data, data, of, catalogue, options);
    if (!out) continue;
    HarmonicFit again = fit_harmonics(base.spec, out->data, base.theta, &base, options.fit);
    if (!again.trouble.empty()) continue;
    out->found = select_effects(std::move(again), out->data, catalogue, options, progress);
    if (!out->found.explained) continue;
    const Hypothesis& now = out->found.hypotheses[out->found.best];
    if (!along_motion(*now.fit, now.data ? *now.data : out->data, options)) return out;
  }
  return std::nullopt;
}

}  // namespace shaker::estimator::diagnosis
