#include "estimator/diagnosis/select/internal/unknown_colour.hpp"

#include <algorithm>
#include <utility>

#include "estimator/diagnosis/noise/internal/noise_colour.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kChosenByChance = 1e-7;  // three effects of some forty may be chosen
constexpr int kColourRounds =
    3;  // of constants and spectrum in turn: the third changes neither by much

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

// True if one fit leaves far less than the other: by more than choosing among all sets of the
// catalogue gains by chance. `more`: numbers that it has more.
bool far_less(const ResidualOf& one, const ResidualOf& other, int more) {
  const double gain = std::max(spectrum_gain(one, other), 0.0);
  return chi_squared_above(gain, std::max(more, 1)) < kChosenByChance;
}

int numbers_of(const HarmonicFit& fit) {
  return static_cast<int>(fit.free.size());
}

const std::vector<RunDatum>& data_of(const Hypothesis& h, const std::vector<RunDatum>& data) {
  return h.data ? *h.data : data;
}

bool closed_by_effects(const Selection& searched, const std::vector<RunDatum>& data) {
  const Hypothesis* best = best_of(searched);
  if (best == nullptr) return false;
  const HarmonicFit& base = *searched.base.fit;
  const int more = numbers_of(*best->fit) - numbers_of(base);
  return more > 0 && far_less({*best->fit, data}, {base, data}, more);
}

std::vector<ColourOf> possible(const std::vector<RunDatum>& data) {
  const bool of_excitation = std::any_of(data.begin(), data.end(),
                                         [](const RunDatum& d) { return d.whitening != nullptr; });
  if (!of_excitation) return {ColourOf::response};
  return {ColourOf::response, ColourOf::excitation};
}

// A fit whose runs differ in their constants (run_constants.hpp) and have noise of unknown colour.
struct BesideConstants {
  HarmonicFit fit;
  std::vector<RunDatum> data;     // with both in their errors
  std::vector<RunDatum> cleared;  // less the likeliest part of the constants
  RunConstants constants;
};

// Estimates the constants and the spectrum of the noise in turn: neither shows while the other is
// taken for it. Empty if the runs do not differ, or if what is left besides is too large for noise.
std::optional<BesideConstants> beside_constants(const HarmonicFit& left,
                                                const std::vector<RunDatum>& fitted,
                                                const std::vector<RunDatum>& data, ColourOf of,
                                                const FitOptions& options) {
  BesideConstants out;
  std::vector<RunDatum> noise = data;
  for (RunDatum& datum : noise)
    datum.budget = std::make_shared<EvaluationBudget>();  // a fixed amount of work
  const HarmonicFit* near = &left;
  for (int round = 0; round < kColourRounds; ++round) {
    auto with = with_run_constants(*near, round == 0 ? fitted : noise, noise, options);
    if (!with || !beyond_chance(with->constants)) return std::nullopt;
    HarmonicFit again = fit_harmonics(left.spec, with->data, near->theta, near, options);
    if (!again.trouble.empty()) return std::nullopt;
    out = {std::move(again), std::move(with->data), {}, with->constants};
    near = &out.fit;
    out.cleared = without_constants(out.fit, out.data, noise);
    if (!may_be_noise(out.fit, out.cleared)) return std::nullopt;
    noise = with_spectrum_left(out.fit, out.cleared, data, of);
  }
  return out;
}

// True if the best hypothesis, beside constants of the runs of its own, leaves far less.
bool closed_by_effects(const BesideConstants& base, const Selection& searched,
                       const std::vector<RunDatum>& data, ColourOf of, const FitOptions& options) {
  const Hypothesis* best = best_of(searched);
  if (best == nullptr) return false;
  const int more = numbers_of(*best->fit) - numbers_of(base.fit) - base.constants.count();
  const ResidualOf left{base.fit, base.cleared};
  if (far_less({*best->fit, data_of(*best, data)}, left, more)) return true;
  const auto rival = beside_constants(*best->fit, data_of(*best, data), data, of, options);
  return rival && far_less({rival->fit, rival->cleared}, left, more + rival->constants.count());
}

// Judges a fit whose data have noise of unknown colour. Empty if more than noise is missing.
std::optional<OfUnknownColour> without_force(HarmonicFit fit, std::vector<RunDatum> data,
                                             const std::vector<Candidate>& catalogue,
                                             const SelectionOptions& options) {
  if (!fit.trouble.empty() || along_motion(fit, data, options)) return std::nullopt;
  OfUnknownColour out;
  out.data = std::move(data);
  out.found = judge(std::move(fit), out.data, catalogue, options);
  if (!out.found.adequate) return std::nullopt;
  return out;
}

// The same for the residual of `left`, with its spectrum as that of the noise.
std::optional<OfUnknownColour> without_force(const HarmonicFit& left,
                                             const std::vector<RunDatum>& fitted,
                                             const std::vector<RunDatum>& data, ColourOf of,
                                             const std::vector<Candidate>& catalogue,
                                             const SelectionOptions& options) {
  if (!may_be_noise(left, fitted)) return std::nullopt;
  std::vector<RunDatum> noisy = with_spectrum_left(left, fitted, data, of);
  HarmonicFit again = fit_harmonics(left.spec, noisy, left.theta, &left, options.fit);
  return without_force(std::move(again), std::move(noisy), catalogue, options);
}

// Repeats the search with the errors in `out`, which leave the best hypothesis nothing but noise.
bool explains(const HarmonicFit& base, const std::vector<Candidate>& catalogue,
              const SelectionOptions& options, const std::function<void(double)>& progress,
              OfUnknownColour& out) {
  HarmonicFit again = fit_harmonics(base.spec, out.data, base.theta, &base, options.fit);
  if (!again.trouble.empty()) return false;
  out.found = select_effects(std::move(again), out.data, catalogue, options, progress);
  if (!out.found.explained) return false;
  const Hypothesis& now = out.found.hypotheses[out.found.best];
  return !along_motion(*now.fit, data_of(now, out.data), options);
}

}  // namespace

std::optional<OfUnknownColour> nothing_but_colour(const Selection& searched,
                                                  const std::vector<RunDatum>& data,
                                                  const std::vector<Candidate>& catalogue,
                                                  const SelectionOptions& options) {
  if (searched.adequate || !on_samples(data)) return std::nullopt;
  const HarmonicFit& base = *searched.base.fit;
  if (!closed_by_effects(searched, data)) {
    for (const ColourOf of : possible(data)) {
      if (auto found = without_force(base, data, data, of, catalogue, options)) return found;
    }
  }
  if (searched.explained) return std::nullopt;
  for (const ColourOf of : possible(data)) {
    auto beside = beside_constants(base, data_of(searched.base, data), data, of, options.fit);
    if (!beside || closed_by_effects(*beside, searched, data, of, options.fit)) continue;
    auto found = without_force(std::move(beside->fit), std::move(beside->data), catalogue, options);
    if (!found) continue;
    found->constants = beside->constants;
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
    auto out = without_force(*best->fit, data_of(*best, data), data, of, catalogue, options);
    if (out && explains(base, catalogue, options, progress, *out)) return out;
  }
  return std::nullopt;
}

}  // namespace shaker::estimator::diagnosis
