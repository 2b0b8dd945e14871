#include "estimator/discrepancy/detect/candidates.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/effects/catalogue.hpp"

namespace shaker::estimator::discrepancy {
namespace {

// A whole grid over three shapes would cost more than it finds: the refit moves them anyway.
constexpr std::size_t kMostProbes = 9;

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
    values = linear(range.low, range.high, {0.5, 0.75, 0.9});  // a place along the stroke
  } else if (wide) {
    if (p.unit == "m/s") high = std::min(high, std::max(range.speed, 2.0 * low));
    // A force at which something gives: of the size of those that move the mass.
    if (p.unit == "m/s^2") high = std::min(high, std::max(range.acceleration, 2.0 * low));
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

std::vector<Probe> probes_of(const Effect& effect, const MotionRange& range) {
  Probe plain;
  plain.line.effect = std::string(effect.name());
  std::vector<const ParameterInfo*> shapes;
  for (const ParameterInfo& p : effect.parameters()) {
    if (std::isnan(p.absent)) {
      shapes.push_back(&p);
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
  const int count = shapes.size() == 1 || (first_only && !effect.in_series()) ? 5 : 3;
  for (const ParameterInfo* shape : shapes) {
    auto values = grid(*shape, range, count);
    const bool dear = first_only && shape != shapes.front();
    if (dear || probes.size() * values.size() > kMostProbes)
      values = {std::clamp(shape->start, shape->lower, shape->upper)};
    std::vector<Probe> finer;
    for (const Probe& probe : probes) {
      for (const double value : values) {
        finer.push_back(probe);
        finer.back().line.parameters[std::string(shape->symbol)].start = value;
      }
    }
    probes = std::move(finer);
  }
  // A force of the stroke is at rest somewhere along it, unless that is about zero anyway: first
  // guesses, which its refit moves.
  for (const ConstantInfo& constant : effect.constants()) {
    const double middle = 0.5 * (range.low + range.high);
    if (constant.symbol != "u0" || std::fabs(middle) < 0.2 * (range.high - range.low)) continue;
    std::vector<Probe> placed;
    for (const double place : linear(range.low, range.high, {0.25, 0.5, 0.75, 0.9})) {
      for (Probe probe : probes) {
        probe.line.constants["u0"] = place;
        placed.push_back(std::move(probe));
      }
    }
    probes = std::move(placed);
  }
  return probes;
}

// What the effect is stated in terms of is in the model.
bool lenders_there(const Effect& effect, const config::ModelSpec& base) {
  const auto borrows = effect.borrows();
  return std::all_of(borrows.begin(), borrows.end(), [&](const Borrowed& b) {
    return std::isfinite(b.otherwise) ||
           std::any_of(base.effects.begin(), base.effects.end(),
                       [&](const config::EffectSpec& line) { return line.effect == b.effect; });
  });
}

bool imposable(const Effect& effect) {
  const auto memory = effect.internals();
  return effect.group() == Group::damper && effect.instrument() == nullptr &&
         !effect.sees_excitation() &&
         std::all_of(memory.begin(), memory.end(),
                     [](const InternalInfo& info) { return info.order == 1; });
}

// Of periodic runs a drift and a grid are read from the records (first_look.hpp), which show them
// better than a mean cycle does.
bool read_beforehand(const Effect& effect, Kind kind) {
  return kind == Kind::periodic &&
         (effect.name() == "sensor_drift" || effect.name() == "sensor_quantisation");
}

}  // namespace

std::vector<Candidate> candidates(const config::ModelSpec& base, const MotionRange& range,
                                  Kind kind) {
  std::vector<Candidate> all;
  for (const Effect* effect : catalogue()) {
    const bool held =
        std::any_of(base.effects.begin(), base.effects.end(),
                    [&](const config::EffectSpec& line) { return line.effect == effect->name(); });
    if (held || effect->parameters().empty() || !lenders_there(*effect, base) ||
        read_beforehand(*effect, kind) || (kind == Kind::imposed_motion && !imposable(*effect)))
      continue;
    all.push_back({effect, probes_of(*effect, range)});
  }
  return all;
}

}  // namespace shaker::estimator::discrepancy
