// In the catalogue, the place of rest u0 of a force k (u - u0) is a constant. It is fitted here: a model
// whose line has the place among its parameters (effects/placed.hpp) is fitted, and its place becomes the
// constant again. With a wrong place of rest other effects (a spring, a sensor offset) would compensate
// and be named too.
#include "estimator/diagnosis/select/internal/centring.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "estimator/diagnosis/fit/internal/places_of_rest.hpp"
#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/internal/motion_range.hpp"
#include "estimator/diagnosis/select/internal/refits.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/placed.hpp"

namespace shaker::estimator::diagnosis {
namespace {

using Eigen::Index;

constexpr PlacesOfRest kAnywhere{-1e12, 1e12};

bool rests_somewhere(const config::EffectSpec& line) {
  const Effect* effect = find_effect(line);
  return effect != nullptr && has_place(*effect);
}

bool is_fitted(const config::EffectSpec& line) {
  return line.constants.contains(kPlace);
}

// Where it is not fitted, a spring rests at zero.
double place_of(const config::EffectSpec& line) {
  const auto stated = line.constants.find(kPlace);
  return stated == line.constants.end() ? 0.0 : stated->second;
}

config::ModelSpec with_place(config::ModelSpec spec, std::size_t line,
                             std::optional<double> place) {
  spec.effects[line].constants.erase(kPlace);
  if (place) spec.effects[line].constants[kPlace] = *place;
  return spec;
}

// The same model with the place among the parameters.
config::ModelSpec with_free_place(const config::ModelSpec& spec, std::size_t line,
                                  const PlacesOfRest& within) {
  config::ModelSpec free = with_place(spec, line, {});
  config::ParameterSpec& place = free.effects[line].parameters[kPlace];
  place.start = place_of(spec.effects[line]);
  place.lower = std::min(within.low, *place.start);
  place.upper = std::max(within.high, *place.start);
  return free;
}

// Index of the place among the parameters of such a model.
std::size_t index_of_place(const Model& free, std::size_t line) {
  const auto& all = free.parameters();
  const auto found = std::find_if(all.begin(), all.end(), [&](const ModelParameter& p) {
    return p.line == line && p.symbol == kPlace;
  });
  return static_cast<std::size_t>(found - all.begin());
}

// A fit whose place is among the parameters, from the parameters of one whose place is a constant.
struct FreePlace {
  HarmonicFit fit;
  std::size_t index = 0;
  int parameter() const { return static_cast<int>(index); }
  double place() const { return fit.theta[index]; }
  std::vector<double> others() const {
    std::vector<double> theta = fit.theta;
    theta.erase(theta.begin() + static_cast<std::ptrdiff_t>(index));
    return theta;
  }
};

FreePlace with_free_place(const HarmonicFit& fit, std::size_t line, const PlacesOfRest& within,
                          const std::vector<RunDatum>& data, const FitOptions& options) {
  const config::ModelSpec spec = with_free_place(fit.spec, line, within);
  FreePlace free;
  free.index = index_of_place(Model(spec), line);
  std::vector<double> theta = fit.theta;
  theta.insert(theta.begin() + static_cast<std::ptrdiff_t>(free.index),
               place_of(fit.spec.effects[line]));
  free.fit = fit_harmonics(spec, data, theta, &fit, options);
  return free;
}

// Of a force in proportion to a power of the stretch.
double power_of(const Effect& effect) {
  const double one = 1.0, zero = 0.0;
  Points at;
  at.n = 1;
  at.u = at.v = at.a = &one;
  double f = 0.0, f_u = 0.0, f_v = 0.0, f_a = 0.0, f_k = 0.0;
  double* const f_theta[] = {&f_k};
  Forces out;
  out.f = &f;
  out.f_u = &f_u;
  out.f_v = &f_v;
  out.f_a = &f_a;
  out.f_theta = f_theta;
  return effect.evaluate(at, &one, &zero, out) ? f_u / f : std::nan("");
}

bool rests_within(const config::EffectSpec& line, const MotionRange& motion) {
  const double place = place_of(line);
  return place >= motion.low && place <= motion.high;
}

// What a parameter costs of chi-squared.
double cost_of_one(const HarmonicFit& fit) {
  return std::log(static_cast<double>(fit.observations));
}

// The free parameters, per unit of the place.
Eigen::VectorXd bends_of(const FreePlace& free, const HarmonicFit& fit, std::ptrdiff_t column) {
  Eigen::VectorXd bends = Eigen::VectorXd::Zero(static_cast<Index>(fit.free.size()));
  for (std::size_t k = 0; k < fit.free.size(); ++k) {
    const int there = fit.free[k] + (fit.free[k] >= free.parameter() ? 1 : 0);
    const auto row = std::find(free.fit.free.begin(), free.fit.free.end(), there);
    if (row == free.fit.free.end()) continue;
    bends[static_cast<Index>(k)] = free.fit.covariance(row - free.fit.free.begin(), column) /
                                   free.fit.covariance(column, column);
  }
  return bends;
}

}  // namespace

std::vector<std::size_t> fitted_places(const config::ModelSpec& spec, std::size_t first_added) {
  std::vector<std::size_t> lines;
  for (std::size_t line = first_added; line < spec.effects.size(); ++line) {
    if (is_fitted(spec.effects[line])) lines.push_back(line);
  }
  return lines;
}

std::optional<config::EffectSpec> same_slope(const HarmonicFit& fit, std::size_t line,
                                             config::EffectSpec other, const MotionRange& motion) {
  const config::EffectSpec& known = fit.spec.effects[line];
  if (!rests_somewhere(known) || !rests_somewhere(other)) return std::nullopt;
  const auto& parameters = fit.model->parameters();
  const auto own = std::find_if(parameters.begin(), parameters.end(),
                                [&](const ModelParameter& p) { return p.line == line; });
  const double size = fit.theta[static_cast<std::size_t>(own - parameters.begin())];
  const double q = power_of(*find_effect(known)), p = power_of(*find_effect(other));
  const double middle = 0.5 * (motion.low + motion.high), stretch = middle - place_of(known);
  // A straight line has no curve to match: then the place stays.
  const double other_stretch = p == 1.0   ? stretch / q
                               : q == 1.0 ? stretch
                                          : stretch * (p - 1.0) / (q - 1.0);
  const ParameterInfo& stiffness = find_effect(other)->parameters().front();
  const double start =
      size * q * std::pow(stretch, q - 1.0) / (p * std::pow(other_stretch, p - 1.0));
  if (!std::isfinite(start) || start < stiffness.lower) return std::nullopt;
  other.parameters[std::string(stiffness.symbol)].start = start;
  other.constants[kPlace] = middle - other_stretch;
  return other;
}

int count_of_places(const config::ModelSpec& spec, std::size_t first_added,
                    const MotionRange& motion) {
  // Where the motion passes zero, springs rest there, and nothing is chosen.
  const bool chosen = motion.low > 0.0 || motion.high < 0.0;
  int count = 0;
  for (std::size_t line = first_added; line < spec.effects.size(); ++line) {
    if (!rests_somewhere(spec.effects[line])) continue;
    const bool fitted = is_fitted(spec.effects[line]);
    if (fitted || chosen) count += !fitted || rests_within(spec.effects[line], motion) ? 1 : 2;
  }
  return count;
}

std::vector<FittedConstant> places_of(const Hypothesis& h, const std::vector<RunDatum>& data,
                                      std::size_t first_added) {
  const HarmonicFit& fit = rounded(h);
  std::vector<FittedConstant> places;
  for (const std::size_t line : fitted_places(fit.spec, first_added)) {
    const double told = place_of(h.fit->spec.effects[line]);
    FitOptions still;
    still.max_iterations = 0;
    still.points = fit.predictions.front().points();
    still.sharp = has_smoothing(fit.spec);
    const FreePlace free = with_free_place(fit, line, kAnywhere, data, still);
    const auto& all = free.fit.free;
    const auto column = std::find(all.begin(), all.end(), free.parameter()) - all.begin();
    const double error = free.fit.standard_error(free.parameter());
    if (column == static_cast<std::ptrdiff_t>(all.size()) || !std::isfinite(error)) continue;
    places.push_back(
        {line, kPlace, fit.spec.length_unit, told, error, bends_of(free, fit, column)});
  }
  return places;
}

// The step at zero says whether the place is worth a parameter.
bool Refits::rests_elsewhere(const HarmonicFit& fit, std::size_t line,
                             const PlacesOfRest& within) const {
  FitOptions still = options_for(fit.spec);
  still.at_once = fit.at_once;
  still.max_iterations = 0;
  const FreePlace free = with_free_place(fit, line, within, data_, still);
  return std::isfinite(free.fit.chi_squared) &&
         std::pow(pull(free.fit, data_, free.parameter()), 2) > cost_of_one(fit);
}

void Refits::centre(Hypothesis& h, std::size_t line) const {
  if (!rests_somewhere(h.fit->spec.effects[line]) || !std::isfinite(h.fit->chi_squared)) return;
  const MotionRange range = range_of(data_);
  const PlacesOfRest within =
      places_of_rest(!rests_at_zero(*base_.model, base_.theta), range.low, range.high);
  if (!is_fitted(h.fit->spec.effects[line]) && !rests_elsewhere(*h.fit, line, within)) return;
  FitOptions options = options_for(h.fit->spec);
  options.at_once = h.fit->at_once;
  const FreePlace free = with_free_place(*h.fit, line, within, data_, options);
  if (!std::isfinite(free.fit.chi_squared)) return;
  const auto at = [&](std::optional<double> place) {
    return std::make_shared<const HarmonicFit>(fit_harmonics(
        with_place(h.fit->spec, line, place), data_, free.others(), &free.fit, options));
  };
  if (free.fit.chi_squared < h.fit->chi_squared) {
    const auto placed = at(free.place());
    if (placed->chi_squared < h.fit->chi_squared) h.fit = placed;
  }
  // A place that the data do not tell from zero is zero.
  const double errors = free.place() / free.fit.standard_error(free.parameter());
  const double cost = cost_of_one(free.fit);
  if (!is_fitted(h.fit->spec.effects[line]) || !(errors * errors < cost)) return;
  const auto at_zero = at({});
  if (at_zero->chi_squared < h.fit->chi_squared + cost) h.fit = at_zero;
}

}  // namespace shaker::estimator::diagnosis
