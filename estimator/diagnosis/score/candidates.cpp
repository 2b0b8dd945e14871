#include "estimator/diagnosis/score/internal/candidates.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimator/diagnosis/fit/internal/places_of_rest.hpp"
#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/scaled.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// A whole grid over three shapes would cost more than it finds: the refit moves them anyway.
constexpr std::size_t kMostProbes = 9;
// Of a tabulated pin, as shares of the strokes that were visited.
constexpr std::initializer_list<double> kKnots = {0.0, 0.25, 0.5, 0.75, 1.0};

std::vector<double> geometric(double low, double high, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i)
    values.push_back(low * std::pow(high / low, (i + 0.5) / count));
  return values;
}

std::vector<double> linear(double low, double high, std::initializer_list<double> shares) {
  std::vector<double> values;
  for (const double share : shares)
    values.push_back(low + share * (high - low));
  return values;
}

// Values of a parameter that only shapes its effect, inside its bounds and inside the motion.
std::vector<double> grid(const ParameterInfo& p, const MotionRange& range, int count) {
  const double low = p.lower;
  double high = p.upper;
  std::vector<double> values;
  const bool wide = low > 0.0 && high / low > 8.0;
  if (p.unit == "m" && (!wide || high >= range.high)) {
    // A place along the stroke: what sets in does so towards its end.
    values = low < 0.0 ? linear(range.low, range.high, {0.1, 0.3, 0.5, 0.7, 0.9})
                       : linear(range.low, range.high, {0.5, 0.75, 0.9});
  } else if (wide) {
    if (p.unit == "m/s") high = std::min(high, std::max(range.speed, 2.0 * low));
    // A force at which something gives: of the size of those that move the mass.
    if (p.unit == "m/s^2") high = std::min(high, std::max(range.force, 2.0 * low));
    values = geometric(low, high, count);
  } else if (std::isfinite(low) && std::isfinite(high)) {
    values = linear(low, high, {0.25, 0.75});
  } else {
    values = {p.start};
  }
  for (double& value : values)
    value = std::clamp(value, p.lower, p.upper);
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

// The motion for which the catalogue's starts, bounds and widths are meant: a landing gear's damper
// on a shaker.
constexpr double kHalfStroke = 0.03;  // m
constexpr double kSpeed = 0.55;       // m/s
constexpr double kForce = 18.0;       // per unit mass, m/s^2
// Of an imposed motion: the force of an added mass of 1, over the largest that is measured. A mass
// begins at the catalogue's 0.02, and may be ten times what would carry the whole force.
constexpr double kInertia = 50.0;

std::vector<Probe> probes_of(const Effect& effect, const MotionRange& range, bool own_zero) {
  Probe plain;
  plain.line.effect = std::string(effect.name());
  plain.line.scale = scale_of(range);
  plain.line.in_series = find_effect(effect.name()) != &effect;
  if (&effect == &tabulated_pin()) plain.line.table = {linear(range.low, range.high, kKnots), {}};
  std::vector<ParameterInfo> shapes;
  for (const ParameterInfo& stated : effect.parameters()) {
    const ParameterInfo p = scaled(effect, stated, plain.line.scale);
    if (std::isnan(p.absent)) {
      if (std::isnan(p.spread)) shapes.push_back(p);  // a prior knows where to begin
      continue;
    }
    const std::string symbol(p.symbol);
    plain.coefficients.push_back(symbol);
    plain.line.parameters[symbol].start = p.absent;
  }
  std::vector<Probe> probes = {plain};
  // Of two shapes without a coefficient only what matters most is varied: each probe is a solution
  // of its own. So it is of a part in series.
  const bool first_only = effect.in_series() || (plain.coefficients.empty() && shapes.size() == 2);
  const int count = (shapes.size() == 1 || first_only) && !effect.in_series() ? 5 : 3;
  for (const ParameterInfo& shape : shapes) {
    auto values = grid(shape, range, count);
    const bool dear = first_only && &shape != shapes.data();
    if (dear || probes.size() * values.size() > kMostProbes)
      values = {std::clamp(shape.start, shape.lower, shape.upper)};
    std::vector<Probe> finer;
    for (const Probe& probe : probes) {
      for (const double value : values) {
        finer.push_back(probe);
        finer.back().line.parameters[std::string(shape.symbol)].start = value;
      }
    }
    probes = std::move(finer);
  }
  // A force of the stroke is at rest at zero, or somewhere along the motion, or preloaded at zero: first
  // guesses, which its refit moves.
  for (const ConstantInfo& constant : effect.constants()) {
    const double middle = 0.5 * (range.low + range.high);
    if (constant.symbol != "u0" || std::fabs(middle) < 0.2 * (range.high - range.low)) continue;
    std::vector<double> places = linear(range.low, range.high, {0.25, 0.5, 0.75, 0.9});
    const PlacesOfRest all = places_of_rest(own_zero, range.low, range.high);
    if (all.low < 0.0 && all.high > 0.0) places.push_back(middle > 0.0 ? all.low : all.high);
    std::vector<Probe> placed = probes;
    for (const double place : places) {
      for (Probe probe : probes) {
        probe.line.constants["u0"] = place;
        placed.push_back(std::move(probe));
      }
    }
    probes = std::move(placed);
  }
  return probes;
}

// Where effects of the damper see and act in a model of several coordinates: as its own do, by what
// the displacement sensor looks at. Null for a model of one coordinate, and where there are none.
const config::EffectSpec* load_path(const config::ModelSpec& base) {
  const auto seen = std::find(base.coordinates.begin(), base.coordinates.end(), base.observed);
  const auto observed = static_cast<std::size_t>(
      seen == base.coordinates.end() ? 0 : seen - base.coordinates.begin());
  for (const config::EffectSpec& line : base.effects) {
    const Effect* known = find_effect(line.effect);
    const bool carries = known == nullptr || known->carries_load();  // unknown: a formula
    if (carries && observed < line.sees.size() && line.sees[observed] != 0.0) return &line;
  }
  return nullptr;
}

bool on_path(const config::EffectSpec& line, const config::EffectSpec* path) {
  return path == nullptr || (line.sees == path->sees && line.acts == path->acts);
}

// What the effect is stated in terms of and the model lacks, or has in another place; empty: none.
std::string_view missing_lender(const Effect& effect, const config::ModelSpec& base,
                                const config::EffectSpec* path) {
  for (const Borrowed& b : effect.borrows()) {
    const bool lent =
        std::isfinite(b.otherwise) ||
        std::any_of(base.effects.begin(), base.effects.end(), [&](const config::EffectSpec& line) {
          return line.effect == b.effect && on_path(line, path);
        });
    if (!lent) return b.effect;
  }
  return {};
}

bool imposable(const Effect& effect) {
  const auto memory = effect.internals();
  return effect.group() == Group::damper && effect.instrument() == nullptr &&
         !effect.sees_excitation() &&
         std::all_of(memory.begin(), memory.end(),
                     [](const InternalInfo& info) { return info.order == 1; });
}

// Of periodic runs a drift and a grid are read from the records (screening.hpp), which show them
// better than a mean cycle does.
bool read_beforehand(const Effect& effect, Kind kind) {
  return kind == Kind::periodic &&
         (effect.name() == "sensor_drift" || effect.name() == "sensor_quantisation");
}

// That an effect carries no load says that it is of a mass, and which one its name does not say;
// one that stands in another place would be two of one name.
bool placeable(const Effect& effect, const config::ModelSpec& base,
               const config::EffectSpec* path) {
  if (path == nullptr || !effect.carries_load()) return false;
  const auto is = [&](const config::EffectSpec& line) { return line.effect == effect.name(); };
  const auto here = [&](const config::EffectSpec& line) { return is(line) && on_path(line, path); };
  const auto& lines = base.effects;
  return std::none_of(lines.begin(), lines.end(), is) ||
         std::any_of(lines.begin(), lines.end(), here);
}

std::string words_of(const std::vector<std::string>& left_out, const config::EffectSpec* path) {
  const std::string names = fmt::format("{}", fmt::join(left_out, ", "));
  if (path == nullptr)
    return fmt::format(
        "not tried: {}; the model has no effect of a damper that sees the observed coordinate, "
        "beside which they could stand",
        names);
  return fmt::format(
      "the model has several coordinates: effects of the damper are tried where its {} sees and "
      "acts; not tried: {}, which belong elsewhere or stand elsewhere already",
      path->effect, names);
}

bool of_damper(const Effect& effect) {
  return effect.group() == Group::damper && effect.instrument() == nullptr;
}

std::string_view why_not_imposed(const Effect& effect) {
  if (effect.group() == Group::exciter || effect.sees_excitation())
    return "an imposed motion has no excitation";
  return effect.instrument() != nullptr ? "an imposed motion is taken as it was measured"
                                        : "an imposed motion does not show a coordinate of its own";
}

constexpr std::string_view kNoPlace =
    "the model has no effect of a damper beside which it could stand";
constexpr std::string_view kOtherPlace =
    "in a model of several coordinates it belongs, or stands, elsewhere";

// Why an effect cannot be scored on such runs; empty: it can.
std::string why_not(const Effect& effect, const config::ModelSpec& base, Kind kind,
                    const config::EffectSpec* path, std::string_view input = {}) {
  const std::string name = config::driven_name(effect.name(), input);
  const bool held =
      std::any_of(base.effects.begin(), base.effects.end(),
                  [&](const config::EffectSpec& line) { return line.effect == name; });
  const bool misplaced =
      base.coordinates.size() > 1 && of_damper(effect) && !placeable(effect, base, path);
  if (held && !misplaced) return "the model holds it";
  if (effect.parameters().empty()) return "it has no parameter that could be fitted";
  if (read_beforehand(effect, kind))
    return "it is read from the records, not fitted, and they do not show it";
  if (kind == Kind::imposed_motion && !imposable(effect))
    return std::string(why_not_imposed(effect));
  if (effect.in_series() && std::ranges::any_of(base.effects, is_in_series))
    return std::string(kOnePartInSeries);
  if (misplaced) return std::string(path == nullptr ? kNoPlace : kOtherPlace);
  if (const auto lender = missing_lender(effect, base, path); !lender.empty())
    return fmt::format("it changes {}, which the model does not hold", lender);
  return {};
}

// A load of the damper that is in proportion to coefficients of its own: an input may drive it. One in
// terms of another effect's parameters changes that effect.
bool may_be_driven(const Effect& effect) {
  bool any = false;
  if (!effect.borrows().empty()) return false;
  for (const ParameterInfo& p : effect.parameters()) {
    if (std::isnan(p.absent)) continue;
    if (p.absent != 0.0) return false;
    any = true;
  }
  return any && of_damper(effect) && effect.carries_load() && !effect.moves_base();
}

// The same forces, in proportion to the input.
Candidate driven_by(const DrivingInput& input, Candidate candidate) {
  for (Probe& probe : candidate.probes) {
    probe.line.effect = config::driven_name(probe.line.effect, input.name);
    probe.line.reference = input.reference;
  }
  return candidate;
}

}  // namespace

config::MotionScale scale_of(const MotionRange& range) {
  const double length = 0.5 * (range.high - range.low);
  if (!(length > 0.0 && range.speed > 0.0 && range.force > 0.0)) return {};
  const double acceleration = range.speed * range.speed / length;
  return {.length = length / kHalfStroke,
          .speed = range.speed / kSpeed,
          .force = range.force / kForce,
          .inertia = range.imposed ? kInertia * range.force / acceleration : 1.0,
          .reach = std::max(std::fabs(range.low), std::fabs(range.high))};
}

Catalogue candidates(const config::ModelSpec& base, const MotionRange& range, Kind kind,
                     std::vector<std::string>& notes, const std::vector<DrivingInput>& inputs) {
  const bool several = base.coordinates.size() > 1;
  const config::EffectSpec* path = several ? load_path(base) : nullptr;
  std::vector<std::string> misplaced;
  Catalogue all;
  const Model model(base);
  const bool own_zero = !rests_at_zero(model, model.start());
  const auto candidate_of = [&](const Effect& effect) {
    Candidate candidate{&effect, probes_of(effect, range, own_zero)};
    if (!several || !of_damper(effect)) return candidate;
    for (Probe& probe : candidate.probes) {
      probe.line.sees = path->sees;
      probe.line.acts = path->acts;
    }
    return candidate;
  };
  for (const Effect* known : catalogue()) {
    const Effect* effect = range.imposed ? &known->as_part_in_series() : known;
    std::string reason = why_not(*effect, base, kind, path);
    if (reason.empty()) {
      all.tried.push_back(candidate_of(*effect));
      continue;
    }
    if (reason == kNoPlace || reason == kOtherPlace) misplaced.emplace_back(effect->name());
    all.not_tried.push_back({std::string(effect->name()), std::move(reason)});
  }
  for (const DrivingInput& input : inputs) {
    for (const Effect* effect : catalogue()) {
      if (!may_be_driven(*effect)) continue;
      std::string reason =
          input.unusable.empty() ? why_not(*effect, base, kind, path, input.name) : input.unusable;
      if (reason.empty())
        all.tried.push_back(driven_by(input, candidate_of(*effect)));
      else
        all.not_tried.push_back(
            {config::driven_name(effect->name(), input.name), std::move(reason)});
    }
  }
  if (!misplaced.empty()) notes.push_back(words_of(misplaced, path));
  return all;
}

}  // namespace shaker::estimator::diagnosis
