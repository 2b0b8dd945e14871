#include "estimator/drop/falling_damper.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "estimator/model/model.hpp"

namespace shaker::estimator {
namespace {

constexpr double kOpenEnd = std::numeric_limits<double>::max();

std::size_t coordinates_of(const config::ModelSpec& spec) {
  return spec.coordinates.empty() ? 1 : spec.coordinates.size();
}

void scale(std::vector<double>& values, double factor) {
  for (double& value : values)
    value *= factor;
}

void scale_forces(std::vector<VisitedCell>& cells, double factor) {
  for (VisitedCell& cell : cells) {
    cell.force *= factor;
    cell.standard_error *= factor;
  }
}

// The masses below the damper keep their size, and count over the new mass on it.
void scale_lower_bodies(config::ModelSpec& spec, double factor) {
  const std::size_t s = coordinates_of(spec);
  for (std::size_t e = 1; e < s; ++e) {
    if (spec.mass.at(e * s) != 0.0)
      throw std::invalid_argument(
          fmt::format("model '{}': equation {} contains the mass on the damper, so that mass "
                      "cannot be changed; "
                      "write each equation as the balance of one body",
                      spec.name, e + 1));
    for (std::size_t k = 0; k < s; ++k)
      spec.mass[e * s + k] *= factor;
    if (e < spec.excitation.size()) spec.excitation[e] *= factor;
  }
}

// All parameters of a catalogue's tyre are over the mass on the damper.
void scale_parameters(const Model& model, config::EffectSpec& line, double factor) {
  for (const ModelParameter& p : model.parameters()) {
    if (p.effect != line.effect) continue;
    config::ParameterSpec& given = line.parameters[p.symbol];
    given.start = factor * given.start.value_or(p.start);
    given.lower = factor * given.lower.value_or(p.lower);
    given.upper = factor * given.upper.value_or(p.upper);
  }
}

config::EffectSpec fixed_on_tyre(const char* effect, const char* symbol, double value) {
  config::EffectSpec line;
  line.effect = effect;
  config::ParameterSpec& parameter = line.parameters[symbol];
  parameter.start = value;
  parameter.lower = 0.0;
  parameter.upper = kOpenEnd;
  parameter.fixed = true;
  line.sees = {0.0, 1.0};
  line.acts = {0.0, 1.0};
  return line;
}

}  // namespace

std::vector<LineKind> line_kinds(const config::ModelSpec& spec) {
  const Model model(spec);
  std::vector<LineKind> kinds;
  for (const config::EffectSpec& line : spec.effects) {
    LineKind kind = line.effect == "gravity" ? LineKind::weight : LineKind::shaker;
    for (const Model::Term& term : model.terms()) {
      if (term.effect->name() != line.effect || kind == LineKind::weight) continue;
      if (term.effect->group() != Group::damper) continue;
      kind = term.effect->moves_base() ? LineKind::base : LineKind::load;
    }
    kinds.push_back(kind);
  }
  return kinds;
}

double unsprung_share(const config::ModelSpec& spec) {
  const std::size_t s = coordinates_of(spec);
  double share = 0.0;
  for (std::size_t e = 1; e < s; ++e)
    share += spec.mass.at(e * s + e);
  return share;
}

config::ModelSpec with_mass(config::ModelSpec spec, double ratio) {
  if (!(ratio > 0.0) || !std::isfinite(ratio))
    throw std::invalid_argument("the mass that falls must be above 0");
  if (ratio == 1.0) return spec;
  const std::size_t s = coordinates_of(spec);
  const auto kinds = line_kinds(spec);
  const Model model(spec);
  scale_lower_bodies(spec, 1.0 / ratio);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    config::EffectSpec& line = spec.effects[i];
    if (kinds[i] == LineKind::shaker) continue;
    if (kinds[i] == LineKind::base) {
      scale_parameters(model, line, 1.0 / ratio);
      continue;
    }
    if (line.sees.empty()) line.sees.assign(s, 1.0);
    if (line.acts.empty()) line.acts.assign(s, 1.0);
    if (kinds[i] == LineKind::load) scale(line.acts, 1.0 / ratio);
    for (std::size_t e = 1; e < s && kinds[i] == LineKind::weight; ++e)
      line.acts[e] /= ratio;
  }
  return spec;
}

DamperHypothesis with_mass(DamperHypothesis h, double ratio) {
  const auto kinds = line_kinds(h.model);
  h.model = with_mass(std::move(h.model), ratio);
  const std::size_t size = h.numbers.size();
  if (h.covariance.size() != size * size) return h;
  for (std::size_t k = 0; k < size; ++k) {
    if (kinds.at(h.numbers[k].line) != LineKind::base) continue;
    for (std::size_t i = 0; i < size; ++i) {
      h.covariance[k * size + i] /= ratio;
      h.covariance[i * size + k] /= ratio;
    }
  }
  return h;
}

IdentifiedDamper with_mass(const IdentifiedDamper& damper, double ratio) {
  IdentifiedDamper falling = damper;
  for (DamperHypothesis& h : falling.hypotheses) {
    h = with_mass(std::move(h), ratio);
    scale_forces(h.left, 1.0 / ratio);
  }
  scale_forces(falling.visited, 1.0 / ratio);
  falling.unnamed_force /= ratio;
  falling.spread.force /= ratio;
  return falling;
}

config::ModelSpec on_tyre(config::ModelSpec spec, const FallingTyre& tyre, double sprung) {
  if (!(tyre.stiffness > 0.0) || !(tyre.unsprung_mass > 0.0) || !(sprung > 0.0) ||
      !(tyre.damping >= 0.0))
    throw std::invalid_argument(
        "a tyre needs a stiffness and an unsprung mass above 0, and a mass above it");
  const auto kinds = line_kinds(spec);
  for (const LineKind kind : kinds) {
    if (kind == LineKind::base || coordinates_of(spec) > 1)
      throw std::invalid_argument(fmt::format(
          "model '{}' has a tyre or coordinates of its own; leave the tyre out", spec.name));
  }
  const double share = tyre.unsprung_mass / sprung;
  spec.coordinates = {"stroke", "tyre"};
  spec.observed = "stroke";
  spec.mass = {1.0, 1.0, 0.0, share};
  spec.excitation = {1.0, share};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    config::EffectSpec& line = spec.effects[i];
    if (kinds[i] == LineKind::shaker) continue;
    const double acts = line.acts.empty() ? 1.0 : line.acts[0];
    line.sees = {1.0, 0.0};
    line.acts = {acts, kinds[i] == LineKind::weight ? acts * share : -acts};
  }
  spec.effects.push_back(fixed_on_tyre("linear_stiffness", "k", tyre.stiffness / sprung));
  spec.effects.push_back(fixed_on_tyre("viscous_damping", "c", tyre.damping / sprung));
  return spec;
}

}  // namespace shaker::estimator
