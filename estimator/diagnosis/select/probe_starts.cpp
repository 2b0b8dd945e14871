#include "estimator/diagnosis/select/internal/probe_starts.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/effects/scaled.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr double kApart = 8.0;

}  // namespace

std::vector<config::EffectSpec> starts_of(const Probe& probe) {
  const Effect* effect = find_effect(probe.line.effect);
  std::vector<config::EffectSpec> starts = {probe.line};
  if (effect == nullptr || probe.coefficients.empty()) return starts;
  starts.push_back(probe.line);
  for (const ParameterInfo& stated : effect->parameters()) {
    const ParameterInfo info = scaled(*effect, stated, probe.line.scale);
    const std::string symbol(info.symbol);
    if (std::isnan(info.absent)) continue;
    starts[0].parameters[symbol].start = info.start;
    starts[1].parameters[symbol].start =
        info.start == info.absent ? info.absent
                                  : 0.5 * (info.absent + std::min(info.upper, 10.0 * info.start));
  }
  return starts;
}

std::vector<config::EffectSpec> placed_apart(const Probe& probe) {
  const Effect* effect = find_effect(probe.line.effect);
  if (effect == nullptr || !probe.coefficients.empty() || effect->parameters().empty()) return {};
  std::vector<config::EffectSpec> lines;
  const ParameterInfo info = scaled(*effect, effect->parameters().front(), probe.line.scale);
  for (const double factor : {1.0 / kApart, kApart}) {
    lines.push_back(probe.line);
    lines.back().parameters[std::string(info.symbol)].start =
        std::clamp(factor * info.start, info.lower, info.upper);
  }
  return lines;
}

bool went_past(const HarmonicFit& fit, const config::EffectSpec& line) {
  for (std::size_t k = 0; k < fit.theta.size(); ++k) {
    const ModelParameter& p = fit.model->parameters()[k];
    const auto of = line.parameters.find(p.symbol);
    if (p.effect != line.effect || of == line.parameters.end() || !of->second.start) continue;
    const double start = *of->second.start, end = fit.theta[k];
    if (fit.at_bound(static_cast<int>(k)) &&
        ((end <= start && start < p.start) || (end >= start && start > p.start)))
      return true;
  }
  return false;
}

}  // namespace shaker::estimator::diagnosis
