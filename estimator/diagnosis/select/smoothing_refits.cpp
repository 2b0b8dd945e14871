// Refits of a hypothesis with the smoothing width that the data support.
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/diagnosis/fit/internal/jumping_friction.hpp"
#include "estimator/diagnosis/fit/internal/predicted_runs.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/select/internal/friction_width.hpp"
#include "estimator/diagnosis/select/internal/nesting.hpp"
#include "estimator/diagnosis/select/internal/refits.hpp"
#include "estimator/diagnosis/select/internal/selection.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// Largest chi-squared with which a stated width is accepted: relative to that of the grid's own
// width, and relative to the noise.
constexpr double kStatedLeaves = 0.5, kStatedNearNoise = 2.0;
constexpr double kByChance = 2.0;         // standard deviations of chi-squared
constexpr int kStatedPoints = 4;          // times those of a grid's corners
constexpr double kTouchedLeftOver = 0.1;  // of chi-squared, by sharper corners

// True if chi-squared is within two standard deviations of what noise alone leaves.
bool leaves_noise(const HarmonicFit& fit) {
  const double n = fit.observations;
  return fit.chi_squared < n + kByChance * std::sqrt(2.0 * n);
}

// True if chi-squared is at most the mean of what noise alone leaves.
bool settled(const HarmonicFit& fit) {
  return fit.chi_squared < static_cast<double>(fit.observations);
}

}  // namespace

// A hypothesis is refitted whether or not it already fits to within the noise: a smoothing width
// moves parameters by whole standard errors in any case. The narrow fit is taken even where it fits
// worse, because the error of a wide one may imitate noise, the better the more parameters there
// are. A record is different: its grid is not finer than its samples, and the error of the
// extrapolation depends on the first width. There the narrow fit is taken only if it fits better.
bool Refits::narrowed(Hypothesis& h, double hopeless) const {
  const bool known = h.blunt == h.fit && hopeless <= h.blunt_above;
  if (h.rounded || known) return false;
  if (!has_smoothing(h.fit->spec)) return resolved(h);
  const bool record = on_samples(data_);
  if (!record && settled(*h.fit) && errors_ == Errors::residual) return false;
  const bool by_width = (record || !settled(*h.fit)) && errors_ == Errors::noise;
  const auto stated = by_width ? as_stated(h) : nullptr;
  if (stated && gentle(h, *stated)) {
    const auto wide = settled(*stated) ? nullptr : as_data_say(h, nullptr, stated.get());
    set_narrowed(h, wide ? wide : stated, nullptr);
    return true;
  }
  ZeroWidthOptions worth;
  worth.hopeless = hopeless;
  if (errors_ == Errors::residual) {
    worth.touched = kTouchedLeftOver;
    worth.on_grids = !record;
  }
  const auto sharp = to_limit(h.fit, worth);
  // Of a record the friction may have a width, although one that jumps, or the limit of three widths,
  // leaves only noise.
  if (by_width && (record || !sharp || !leaves_noise(*sharp->fit))) {
    if (const auto wide = as_data_say(h, sharp ? sharp->fit.get() : nullptr, stated.get())) {
      set_narrowed(h, wide, nullptr);
      return true;
    }
  }
  if (!sharp) {
    h.blunt = h.fit;
    h.blunt_above = hopeless;
    return false;
  }
  set_narrowed(h, sharp->fit, sharp->data);
  return true;
}

// Uses the limit of zero width of an earlier search, if that leaves no more than noise.
void Refits::narrow_as(const Hypothesis& known, Hypothesis& h) const {
  if (!known.rounded || !h.disqualified.empty() || on_samples(data_)) return;
  const auto sharp = carried(*known.fit, *known.data, data_, options_);
  if (sharp && leaves_noise(*sharp->fit)) set_narrowed(h, sharp->fit, sharp->data);
}

void Refits::finish_narrowing(Hypothesis& h) const {
  if (!h.rounded || errors_ != Errors::residual || on_samples(data_) || !has_smoothing(h.fit->spec))
    return;
  const auto sharp = to_limit(h.rounded, {.touched = kTouchedLeftOver});
  if (!sharp || !(sharp->fit->chi_squared < h.fit->chi_squared)) return;
  Hypothesis finished = h;
  set_narrowed(finished, sharp->fit, sharp->data);
  if (finished.disqualified.empty()) h = std::move(finished);
}

// Takes a fit to zero width. Empty if the result is not to be trusted.
std::optional<ZeroWidthFit> Refits::to_limit(const std::shared_ptr<const HarmonicFit>& round,
                                             const ZeroWidthOptions& worth) const {
  const bool record = on_samples(data_);
  if (can_jump(round->spec, data_)) {
    auto jumping = round->at_once ? round : fit_of_jumps(*round, data_, options_for(round->spec));
    if (jumping && jumping->chi_squared <= round->chi_squared)
      return ZeroWidthFit{std::move(jumping), std::make_shared<const std::vector<RunDatum>>(data_)};
  }
  auto sharp = to_zero_width(*round, data_, options_, worth);
  const bool believed =
      sharp && (record ? sharp->fit->chi_squared <= round->chi_squared : sharp->fit->converged);
  return believed ? sharp : std::nullopt;
}

void Refits::set_narrowed(Hypothesis& h, std::shared_ptr<const HarmonicFit> fit,
                          std::shared_ptr<const std::vector<RunDatum>> data) const {
  if (!h.rounded) h.rounded = h.fit;
  h.fit = std::move(fit);
  h.data = data ? std::move(data) : std::make_shared<const std::vector<RunDatum>>(data_);
  judge(h);
  describe(h);
}

// The friction of a seal may reverse as gently as the catalogue says. Then the catalogue's width
// leaves only noise, and the grid's width leaves more. This refit states the catalogue's width in
// the model.
std::shared_ptr<const HarmonicFit> Refits::as_stated(const Hypothesis& h) const {
  const config::ModelSpec spec = stated_for(h.fit->spec);
  const Model model(spec);
  if (model.coordinates() > model.mechanical()) return nullptr;
  FitOptions fine = options_for(spec);
  fine.points *= kStatedPoints;  // so that their steps do not pass the width at once
  fine.from_near = true;
  auto fit = std::make_shared<const HarmonicFit>(
      fit_harmonics(spec, data_, h.fit->theta, h.fit.get(), fine));
  return fit->converged ? fit : nullptr;
}

// The width is a parameter of this fit. It starts from the better of the two fits that are given, and
// from the other one where that leads nowhere: a limit of zero width may be too far off for it.
std::shared_ptr<const HarmonicFit> Refits::as_data_say(const Hypothesis& h,
                                                       const HarmonicFit* at_once,
                                                       const HarmonicFit* stated) const {
  const auto leaves = [](const HarmonicFit* fit) {
    return fit != nullptr ? fit->chi_squared : std::numeric_limits<double>::infinity();
  };
  const double least = std::min(leaves(at_once), leaves(stated));
  const auto from = [&](const HarmonicFit* near) -> std::shared_ptr<const HarmonicFit> {
    if (near == nullptr) return nullptr;
    double most = kStatedNearNoise * static_cast<double>(near->observations);
    // Along a motion that is known a fit costs little, and is believed far from noise too.
    if (along_motion(data_))
      most = std::max(most, kStatedLeaves * std::min(least, near->chi_squared));
    auto fit = with_fitted_width(*near, near == at_once, data_, options_, most);
    return fit && fit->chi_squared < least ? fit : nullptr;
  };
  const bool sharp = leaves(at_once) <= leaves(stated);
  auto fit = from(sharp ? at_once : stated);
  if (!fit) fit = from(sharp ? stated : at_once);
  return fit && !richer_does_it(h, *fit) ? fit : nullptr;
}

// True if the fit with the stated width is accepted.
bool Refits::gentle(const Hypothesis& h, const HarmonicFit& fit) const {
  const double most = std::min(kStatedLeaves * h.fit->chi_squared,
                               kStatedNearNoise * static_cast<double>(fit.observations));
  return fit.chi_squared <= most && !richer_does_it(h, fit);
}

// True if an added effect has reduced to its simpler special case: then it only corrects another
// width.
bool Refits::richer_does_it(const Hypothesis& h, const HarmonicFit& fit) const {
  return std::any_of(h.effects.begin(), h.effects.end(),
                     [&](const std::string& effect) { return reduces(fit, effect); });
}

// Tests widths that the model file states on a grid that resolves them. If another width leaves
// less, the width of the data is taken.
bool Refits::resolved(Hypothesis& h) const {
  FitOptions fine = options_for(h.fit->spec);
  const int coarse = h.fit->predictions.front().points();
  fine.points = points_for(h.fit->spec, data_, coarse);
  fine.from_near = true;
  std::shared_ptr<const HarmonicFit> fit = h.fit;
  if (fine.points != coarse)
    fit = std::make_shared<const HarmonicFit>(
        fit_harmonics(h.fit->spec, data_, h.fit->theta, h.fit.get(), fine));
  if (fit->converged && errors_ == Errors::noise && !settled(*fit)) {
    if (auto wide = as_data_say(h, nullptr, fit.get())) fit = std::move(wide);
  }
  if (fit == h.fit || !fit->converged) {
    h.blunt = h.fit;
    h.blunt_above = std::numeric_limits<double>::infinity();
    return false;
  }
  set_narrowed(h, std::move(fit), nullptr);
  return true;
}

void take_to_zero_width(Selection& found, std::size_t hypothesis, const std::vector<RunDatum>& data,
                        const FitOptions& options) {
  const Refits refits(*found.base.fit, data, options, Errors::residual);
  Hypothesis& wide = found.hypotheses[hypothesis];
  Hypothesis sharp = wide;
  const bool better = refits.narrowed(sharp) && sharp.fit->chi_squared < wide.fit->chi_squared;
  if (better && sharp.disqualified.empty()) wide = std::move(sharp);
  refits.finish_narrowing(wide);
}

}  // namespace shaker::estimator::diagnosis
