// Refits with corners as sharp, or as wide, as the data have them.
#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/diagnosis/fit/smoothing.hpp"
#include "estimator/diagnosis/select/friction_width.hpp"
#include "estimator/diagnosis/select/nesting.hpp"
#include "estimator/diagnosis/select/refits.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// Of chi-squared, that corners of the stated width leave at most: of a grid's, and of noise.
constexpr double kStatedLeaves = 0.5, kStatedNearNoise = 2.0;
constexpr double kByChance = 2.0;         // standard deviations of chi-squared
constexpr int kStatedPoints = 4;          // times those of a grid's corners
constexpr double kTouchedLeftOver = 0.1;  // of chi-squared, by sharper corners

// No more than chance makes of it.
bool leaves_noise(const HarmonicFit& fit) {
  const double n = fit.observations;
  return fit.chi_squared < n + kByChance * std::sqrt(2.0 * n);
}

// As little as noise leaves on the average.
bool settled(const HarmonicFit& fit) {
  return fit.chi_squared < static_cast<double>(fit.observations);
}

}  // namespace

// Whether or not the round corner leaves more than noise: it moves parameters by standard errors
// all the same. And whether or not the sharp one leaves more: a round one's error may fit the
// noise, and the more parameters there are the better. A record has no finer grid than its samples,
// though, and how far its extrapolation is from the limit depends on the width that it begins with:
// there it is believed only where it fits better.
bool Refits::sharpened(Hypothesis& h, double hopeless) const {
  const bool known = h.blunt == h.fit && hopeless <= h.blunt_above;
  if (h.rounded || known) return false;
  if (!has_smoothing(h.fit->spec)) return resolved(h);
  const bool record = on_samples(data_);
  if (settled(*h.fit) && (record || errors_ == Errors::residual)) return false;
  const bool by_width = !settled(*h.fit) && !record && errors_ == Errors::noise;
  const auto stated = by_width ? as_stated(h) : nullptr;
  if (stated && gentle(h, *stated)) {
    const auto wide = settled(*stated) ? nullptr : as_data_say(h, nullptr, stated.get());
    sharpened_to(h, wide ? wide : stated, nullptr);
    return true;
  }
  Sharpening worth;
  worth.hopeless = hopeless;
  if (errors_ == Errors::residual) {
    worth.touched = kTouchedLeftOver;
    worth.on_grids = !record;
  }
  const auto sharp = to_limit(*h.fit, worth);
  if (by_width && !(sharp && leaves_noise(*sharp->fit))) {
    if (const auto wide = as_data_say(h, sharp ? sharp->fit.get() : nullptr, stated.get())) {
      sharpened_to(h, wide, nullptr);
      return true;
    }
  }
  if (!sharp) {
    h.blunt = h.fit;
    h.blunt_above = hopeless;
    return false;
  }
  sharpened_to(h, sharp->fit, sharp->data);
  return true;
}

// What corners of no width do is known of an earlier search, where that leaves but noise.
void Refits::sharpen_as(const Hypothesis& known, Hypothesis& h) const {
  if (!known.rounded || !h.disqualified.empty() || on_samples(data_)) return;
  const auto sharp = carried(*known.fit, *known.data, data_, options_);
  if (sharp && leaves_noise(*sharp->fit)) sharpened_to(h, sharp->fit, sharp->data);
}

void Refits::finish_sharpening(Hypothesis& h) const {
  if (!h.rounded || errors_ != Errors::residual || on_samples(data_) || !has_smoothing(h.fit->spec))
    return;
  const auto sharp = to_limit(*h.rounded, {.touched = kTouchedLeftOver});
  if (!sharp || !(sharp->fit->chi_squared < h.fit->chi_squared)) return;
  Hypothesis finished = h;
  sharpened_to(finished, sharp->fit, sharp->data);
  if (finished.disqualified.empty()) h = std::move(finished);
}

// Nothing where that is not believed.
std::optional<Sharpened> Refits::to_limit(const HarmonicFit& round, const Sharpening& worth) const {
  const bool record = on_samples(data_);
  auto sharp = sharpen(round, data_, options_, worth);
  const bool believed =
      sharp && (record ? sharp->fit->chi_squared <= round.chi_squared : sharp->fit->converged);
  return believed ? sharp : std::nullopt;
}

void Refits::sharpened_to(Hypothesis& h, std::shared_ptr<const HarmonicFit> fit,
                          std::shared_ptr<const std::vector<RunDatum>> data) const {
  if (!h.rounded) h.rounded = h.fit;
  h.fit = std::move(fit);
  h.data = data ? std::move(data) : std::make_shared<const std::vector<RunDatum>>(data_);
  judge(h);
  describe(h);
}

// A seal may turn its friction round as gently as the catalogue says: then that leaves but noise,
// where a grid's corners leave more. From the model of which they were made: the width is stated.
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

// Neither at once nor as that, but as the data say: from the better of the two, where there is one.
std::shared_ptr<const HarmonicFit> Refits::as_data_say(const Hypothesis& h,
                                                       const HarmonicFit* at_once,
                                                       const HarmonicFit* stated) const {
  const bool sharp =
      at_once != nullptr && (stated == nullptr || at_once->chi_squared <= stated->chi_squared);
  const HarmonicFit* near = sharp ? at_once : stated;
  if (near == nullptr) return nullptr;
  const double most = kStatedNearNoise * static_cast<double>(near->observations);
  auto fit = with_fitted_width(*near, sharp, data_, options_, most);
  return fit && !richer_does_it(h, *fit) ? fit : nullptr;
}

// The stated width is believed.
bool Refits::gentle(const Hypothesis& h, const HarmonicFit& fit) const {
  const double most = std::min(kStatedLeaves * h.fit->chi_squared,
                               kStatedNearNoise * static_cast<double>(fit.observations));
  return fit.chi_squared <= most && !richer_does_it(h, fit);
}

// A richer effect that says what the simpler one does mends another width.
bool Refits::richer_does_it(const Hypothesis& h, const HarmonicFit& fit) const {
  return std::any_of(h.effects.begin(), h.effects.end(),
                     [&](const std::string& effect) { return reduces(fit, effect); });
}

// Widths that the model file states are held against the data on a grid that can follow them; where
// another one leaves less, as wide as the data say.
bool Refits::resolved(Hypothesis& h) const {
  FitOptions fine = options_for(h.fit->spec);
  const int coarse = h.fit->predictions.front().points();
  fine.points = points_for(h.fit->spec, data_, coarse);
  fine.from_near = true;
  std::shared_ptr<const HarmonicFit> fit = h.fit;
  if (fine.points != coarse)
    fit = std::make_shared<const HarmonicFit>(
        fit_harmonics(h.fit->spec, data_, h.fit->theta, h.fit.get(), fine));
  if (fit->converged && errors_ == Errors::noise && !settled(*fit) && !on_samples(data_)) {
    if (auto wide = as_data_say(h, nullptr, fit.get())) fit = std::move(wide);
  }
  if (fit == h.fit || !fit->converged) {
    h.blunt = h.fit;
    h.blunt_above = std::numeric_limits<double>::infinity();
    return false;
  }
  sharpened_to(h, std::move(fit), nullptr);
  return true;
}

}  // namespace shaker::estimator::diagnosis
