#include "estimator/model.hpp"

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimator/effects/catalogue.hpp"

namespace shaker::estimator {
namespace {

[[noreturn]] void reject(const config::ModelSpec& model, const std::string& why) {
  throw std::invalid_argument(fmt::format(
      "{}: {}", model.origin.empty() ? "model '" + model.name + "'" : model.origin, why));
}

std::string known_effects() {
  std::vector<std::string_view> names;
  for (const Effect* effect : catalogue())
    names.push_back(effect->name());
  return fmt::format("{}", fmt::join(names, ", "));
}

// "1/m" becomes "1/ft" in a model that counts in feet.
std::string relabel(std::string_view unit, const std::string& length) {
  std::string text(unit);
  if (length == "m") return text;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool alone =
        (i == 0 || !std::isalpha(static_cast<unsigned char>(text[i - 1]))) &&
        (i + 1 == text.size() || !std::isalpha(static_cast<unsigned char>(text[i + 1])));
    if (text[i] == 'm' && alone) {
      text.replace(i, 1, length);
      i += length.size() - 1;
    }
  }
  return text;
}

std::vector<double> one_or(const std::vector<double>& given, std::size_t size, double value) {
  return given.empty() && size == 1 ? std::vector<double>{value} : given;
}

}  // namespace

Model::Model(const config::ModelSpec& spec)
    : name_(spec.name),
      length_unit_(spec.length_unit),
      coordinates_(std::max<int>(1, static_cast<int>(spec.coordinates.size()))) {
  const auto s = static_cast<std::size_t>(coordinates_);
  mass_ = one_or(spec.mass, s, 1.0);
  excitation_ = one_or(spec.excitation, s, 1.0);
  if (mass_.size() != s * s)
    reject(spec,
           fmt::format("/mass has {} numbers; {} coordinates need {}", mass_.size(), s, s * s));
  if (excitation_.size() != s)
    reject(spec, fmt::format("/excitation has {} numbers; {} coordinates need one each",
                             excitation_.size(), s));
  if (!spec.observed.empty()) {
    const auto found = std::find(spec.coordinates.begin(), spec.coordinates.end(), spec.observed);
    if (found == spec.coordinates.end())
      reject(spec, fmt::format("/observed '{}' is none of the coordinates: {}", spec.observed,
                               fmt::join(spec.coordinates, ", ")));
    observed_ = static_cast<int>(found - spec.coordinates.begin());
  }
  if (spec.effects.empty()) reject(spec, "/effects is empty: a model needs at least one effect");
  for (std::size_t i = 0; i < spec.effects.size(); ++i)
    add_effect(spec.effects[i], i, spec);
}

void Model::add_effect(const config::EffectSpec& spec, std::size_t index,
                       const config::ModelSpec& model) {
  const auto place = fmt::format("/effects/{}", index);
  const Effect* effect = find_effect(spec.effect);
  if (effect == nullptr)
    reject(model, fmt::format("{}: there is no effect '{}'; there are {}", place, spec.effect,
                              known_effects()));
  Term term{effect, parameter_count(), {}, {}, {}};
  const auto s = static_cast<std::size_t>(coordinates_);
  term.sees = one_or(spec.sees, s, 1.0);
  term.acts = one_or(spec.acts, s, 1.0);
  if (term.sees.size() != s || term.acts.size() != s)
    reject(model,
           fmt::format("{}: 'sees' and 'acts' need one number for each of the {} coordinates",
                       place, s));

  for (const ConstantInfo& info : effect->constants()) {
    const auto given = spec.constants.find(std::string(info.symbol));
    double value = given != spec.constants.end() ? given->second : info.value;
    if (effect->name() == "gravity" && given == spec.constants.end()) value = model.gravity;
    term.constants.push_back(value);
  }
  for (const auto& given : spec.constants) {
    const std::string& symbol = given.first;
    const auto constants = effect->constants();
    if (std::none_of(constants.begin(), constants.end(),
                     [&](const ConstantInfo& c) { return c.symbol == symbol; }))
      reject(model,
             fmt::format("{}/constants: {} has no constant '{}'", place, spec.effect, symbol));
  }
  for (const auto& given : spec.parameters) {
    const std::string& symbol = given.first;
    const auto known = effect->parameters();
    if (std::none_of(known.begin(), known.end(),
                     [&](const ParameterInfo& p) { return p.symbol == symbol; })) {
      std::vector<std::string_view> names;
      for (const ParameterInfo& p : known)
        names.push_back(p.symbol);
      reject(
          model,
          fmt::format("{}/parameters: {} has no parameter '{}'; it has {}", place, spec.effect,
                      symbol, names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
    }
  }
  for (const ParameterInfo& info : effect->parameters()) {
    const auto given = spec.parameters.find(std::string(info.symbol));
    const config::ParameterSpec empty;
    const config::ParameterSpec& said = given != spec.parameters.end() ? given->second : empty;
    ModelParameter p;
    p.name = std::string(info.symbol);
    if (std::any_of(parameters_.begin(), parameters_.end(),
                    [&](const ModelParameter& other) { return other.name == p.name; }))
      p.name = fmt::format("{}[{}].{}", spec.effect, index, info.symbol);
    p.effect = spec.effect;
    p.unit = relabel(info.unit, length_unit_);
    p.lower = said.lower.value_or(info.lower);
    p.upper = said.upper.value_or(info.upper);
    p.start = said.start.value_or(std::clamp(info.start, p.lower, p.upper));
    p.fixed = said.fixed;
    if (said.prior_mean && said.prior_standard_deviation) {
      p.prior_mean = said.prior_mean;
      p.prior_standard_deviation = said.prior_standard_deviation;
    }
    if (!(p.lower <= p.upper))
      reject(model, fmt::format("{}/parameters/{}: lower bound {} is above the upper bound {}",
                                place, info.symbol, p.lower, p.upper));
    if (!(p.start >= p.lower && p.start <= p.upper))
      reject(model, fmt::format("{}/parameters/{}/start: {} is outside its bounds [{}, {}]", place,
                                info.symbol, p.start, p.lower, p.upper));
    parameters_.push_back(std::move(p));
  }
  terms_.push_back(std::move(term));
}

std::vector<double> Model::start() const {
  std::vector<double> theta;
  for (const ModelParameter& p : parameters_)
    theta.push_back(p.start);
  return theta;
}

}  // namespace shaker::estimator
