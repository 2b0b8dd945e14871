#include "estimator/model/identified_damper.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <utility>

namespace shaker::estimator {
namespace {

// The names of the effects of sensors and exciter in the model.
std::set<std::string, std::less<>> instruments_of(const Model& model) {
  std::set<std::string, std::less<>> names;
  for (const Model::Term& term : model.instruments())
    names.emplace(term.effect->name());
  for (const Model::Term& term : model.terms()) {
    if (term.effect->group() != Group::damper) names.emplace(term.effect->name());
  }
  return names;
}

// Fixes number k at `value`: the others follow, and their covariance is that given the value.
void condition_on(std::size_t k, double value, DamperHypothesis& h) {
  const std::size_t size = h.numbers.size();
  const double variance = h.covariance[k * size + k];
  const double moved = value - value_of(h.model, h.numbers[k]);
  std::vector<double> rest;
  for (std::size_t i = 0; i < size; ++i) {
    if (i == k) continue;
    const double share = variance > 0.0 ? h.covariance[i * size + k] / variance : 0.0;
    set_value(h.model, h.numbers[i], value_of(h.model, h.numbers[i]) + share * moved);
    for (std::size_t j = 0; j < size; ++j) {
      if (j != k) rest.push_back(h.covariance[i * size + j] - share * h.covariance[k * size + j]);
    }
  }
  set_value(h.model, h.numbers[k], value);
  h.covariance = std::move(rest);
  h.numbers.erase(h.numbers.begin() + static_cast<std::ptrdiff_t>(k));
}

}  // namespace

std::vector<ModelNumber> numbers_of(const Model& model) {
  std::vector<ModelNumber> numbers;
  for (const ModelParameter& p : model.parameters())
    numbers.push_back({p.line, p.symbol});
  return numbers;
}

double value_of(const config::ModelSpec& spec, const ModelNumber& number) {
  const config::EffectSpec& line = spec.effects.at(number.line);
  if (number.constant) return line.constants.at(number.symbol);
  const auto given = line.parameters.find(number.symbol);
  if (given != line.parameters.end() && given->second.start) return *given->second.start;
  const Model model(spec);
  const auto places = numbers_of(model);
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (places[k].line == number.line && places[k].symbol == number.symbol)
      return model.parameters()[k].start;
  }
  return 0.0;
}

void set_value(config::ModelSpec& spec, const ModelNumber& number, double value) {
  config::EffectSpec& line = spec.effects.at(number.line);
  if (number.constant)
    line.constants[number.symbol] = value;
  else
    line.parameters[number.symbol].start = value;
}

std::optional<DamperHypothesis> held_at_bounds(const DamperHypothesis& hypothesis) {
  constexpr double kNearBound = 2.5;  // standard errors
  const Model model(hypothesis.model);
  const auto places = numbers_of(model);
  const auto parameter_of = [&](const ModelNumber& number) -> const ModelParameter* {
    for (std::size_t k = 0; k < places.size() && !number.constant; ++k) {
      if (places[k].line == number.line && places[k].symbol == number.symbol)
        return &model.parameters()[k];
    }
    return nullptr;
  };
  DamperHypothesis held = hypothesis;
  double log_weight = 0.0;
  for (std::size_t k = held.numbers.size(); k-- > 0;) {
    const ModelParameter* p = parameter_of(held.numbers[k]);
    const double error = std::sqrt(held.covariance[k * held.numbers.size() + k]);
    if (p == nullptr || !(error > 0.0)) continue;
    const double value = value_of(held.model, held.numbers[k]);
    const double bound = value - p->lower < p->upper - value ? p->lower : p->upper;
    const double away = std::fabs(value - bound) / error;
    if (!(away < kNearBound)) continue;
    log_weight -= 0.5 * away * away;
    condition_on(k, bound, held);
  }
  if (held.numbers.size() == hypothesis.numbers.size()) return std::nullopt;
  for (const ModelNumber& number : held.numbers) {
    const ModelParameter* p = parameter_of(number);
    const double value = value_of(held.model, number);
    if (p != nullptr && !(value >= p->lower && value <= p->upper)) return std::nullopt;
  }
  held.probability = 0.5 * std::exp(log_weight) * hypothesis.probability;
  return held;
}

DamperHypothesis without_instruments(const DamperHypothesis& hypothesis) {
  DamperHypothesis damper = hypothesis;
  const auto instruments = instruments_of(Model(hypothesis.model));
  damper.model.effects.clear();
  std::vector<std::size_t> line_of(hypothesis.model.effects.size());
  std::vector<char> kept(line_of.size(), 0);
  for (std::size_t i = 0; i < line_of.size(); ++i) {
    if (instruments.contains(hypothesis.model.effects[i].effect)) continue;
    kept[i] = 1;
    line_of[i] = damper.model.effects.size();
    damper.model.effects.push_back(hypothesis.model.effects[i]);
  }
  std::erase_if(damper.effects, [&](const std::string& e) { return instruments.contains(e); });
  std::vector<std::size_t> rows;
  damper.numbers.clear();
  for (std::size_t k = 0; k < hypothesis.numbers.size(); ++k) {
    const ModelNumber& number = hypothesis.numbers[k];
    if (!kept.at(number.line)) continue;
    rows.push_back(k);
    damper.numbers.push_back({line_of[number.line], number.symbol, number.constant});
  }
  damper.covariance.clear();
  for (const std::size_t i : rows) {
    for (const std::size_t k : rows)
      damper.covariance.push_back(hypothesis.covariance[i * hypothesis.numbers.size() + k]);
  }
  return damper;
}

}  // namespace shaker::estimator
