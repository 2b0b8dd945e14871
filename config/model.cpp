#include "config/model.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/unit.hpp"
#include "config/model_reader.hpp"
#include "config/pin_table.hpp"

namespace shaker::config {
namespace {

constexpr double kLargestGravity = 1000.0;  // m/s^2
// Far more than any model of a damper needs; all are compared with each other.
constexpr std::size_t kCoordinatesMax = 100, kEffectsMax = 200;

constexpr double kLargestSmoothness = 10.0;

bool is_known_length(const std::string& unit) {
  return unit_called(unit, Dimension::length) || unit_called(unit, Dimension::angle);
}

// "per": "run", or "over": "gas_temperature" with its "reference".
void read_variation(ObjectReader& reader, ParameterSpec& spec) {
  static const std::string kinds[] = {"run", "group"};
  RunVariation& variation = spec.variation;
  if (const auto kind = reader.choice("per", kinds, false)) variation.per = kinds[*kind];
  reader.optional("over", variation.over);
  reader.optional("reference", variation.reference, above(0));
  if (!variation.per.empty() && !variation.over.empty())
    reader.complain("over", fmt::format("stands beside \"per\": \"{}\"; leave one of the two out: "
                                        "values of their own have no law over a condition",
                                        variation.per));
  if (!variation.per.empty() && spec.fixed)
    reader.complain("per",
                    "stands beside \"fixed\": a parameter that is not estimated has no "
                    "values to tell apart; leave one of the two out");
  if (variation.reference && variation.over.empty())
    reader.complain("reference",
                    "stands beside \"over\" only: it is the condition at which the "
                    "parameter is stated");
  if (reader.member("over", false) != nullptr && variation.condition().empty())
    reader.complain("over", "names no condition of the runs; say for example \"gas_temperature\"");
}

ParameterSpec read_parameter(const Node& node, const std::string& pointer, Findings& findings) {
  ParameterSpec spec;
  ObjectReader reader(node, pointer, findings);
  reader.optional("start", spec.start);
  reader.optional("lower", spec.lower);
  reader.optional("upper", spec.upper);
  reader.optional("fixed", spec.fixed);
  reader.optional("unit", spec.unit);
  reader.optional("prior_mean", spec.prior_mean);
  reader.optional("prior_standard_deviation", spec.prior_standard_deviation, above(0));
  read_variation(reader, spec);
  reader.finish();
  if (spec.lower && spec.upper && *spec.upper <= *spec.lower) {
    reader.complain(
        "upper", fmt::format("{} is not above \"lower\", which is {}", *spec.upper, *spec.lower));
  } else if (spec.start && ((spec.lower && *spec.start < *spec.lower) ||
                            (spec.upper && *spec.start > *spec.upper))) {
    reader.complain("start", fmt::format("{} is outside of its bounds; at least {} and at most {} "
                                         "is allowed",
                                         *spec.start, spec.lower.value_or(-INFINITY),
                                         spec.upper.value_or(INFINITY)));
  }
  if (spec.prior_mean.has_value() != spec.prior_standard_deviation.has_value()) {
    reader.complain(spec.prior_mean ? "prior_mean" : "prior_standard_deviation",
                    "a prior wants both \"prior_mean\" and \"prior_standard_deviation\"");
  }
  return spec;
}

std::vector<double> read_numbers(ObjectReader& reader, Findings& findings, const std::string& key) {
  std::vector<double> numbers;
  reader.array(key, false, 1, [&](const Node& node, const std::string& pointer) {
    if (node.kind != Node::Kind::integer && node.kind != Node::Kind::number) {
      findings.add(node, pointer, fmt::format("{} is not a number", node.shown()));
    }
    numbers.push_back(node.number);
  });
  return numbers;
}

// Reads the parts of an effect that the model file itself defines.
void read_formula(ObjectReader& reader, Findings& findings, EffectSpec& spec) {
  reader.optional("formula", spec.formula);
  if (const Node* states = reader.member("states", false)) {
    ObjectReader inner(*states, reader.at("states"), findings);
    for (std::size_t i = 0; i < states->keys.size(); ++i) {
      StateSpec& state = spec.states[states->keys[i]];
      ObjectReader one(states->elements[i], inner.at(states->keys[i]), findings);
      one.required("rate", state.rate);
      one.optional("start", state.start);
      one.finish();
    }
  }
  if (const Node* borrows = reader.member("borrows", false)) {
    ObjectReader inner(*borrows, reader.at("borrows"), findings);
    for (const std::string& key : borrows->keys)
      inner.required(key, spec.borrows[key]);
  }
  if (!spec.formula.empty()) return;
  for (const char* key : {"states", "borrows"}) {
    if (reader.member(key, false) != nullptr)
      reader.complain(key, "stands beside a \"formula\" only");
  }
}

// A table of knots whose strokes increase, and whose areas change in one direction only.
void read_table(ObjectReader& effect, Findings& findings, EffectSpec& spec) {
  const Node* node = effect.member("table", false);
  if (node == nullptr) return;
  PinTable& table = spec.table.emplace();
  ObjectReader reader(*node, effect.at("table"), findings);
  reader.member("stroke", true);
  table.stroke = read_numbers(reader, findings, "stroke");
  table.area = read_numbers(reader, findings, "area");
  reader.optional("smoothness", table.smoothness, above(0).at_most(kLargestSmoothness));
  reader.finish();
  if (table.stroke.empty()) return;
  if (const std::string wrong = fault_of(table); !wrong.empty()) effect.complain("table", wrong);
}

// "input": "current", and the "reference" at which the coefficients are stated.
void read_input(ObjectReader& reader, EffectSpec& spec) {
  std::string input;
  reader.optional("input", input);
  spec.effect = driven_name(spec.effect, input);
  reader.optional("reference", spec.reference, above(0));
  if (spec.reference && input.empty())
    reader.complain("reference",
                    "stands beside \"input\" only: it is the input at which the coefficients are "
                    "stated");
}

EffectSpec read_effect(const Node& node, const std::string& pointer, Findings& findings) {
  EffectSpec spec;
  ObjectReader reader(node, pointer, findings);
  reader.required("effect", spec.effect);
  read_input(reader, spec);
  if (const Node* parameters = reader.member("parameters", false)) {
    ObjectReader inner(*parameters, reader.at("parameters"), findings);
    for (std::size_t i = 0; i < parameters->keys.size(); ++i) {
      const std::string& symbol = parameters->keys[i];
      spec.parameters.emplace(symbol,
                              read_parameter(parameters->elements[i], inner.at(symbol), findings));
    }
  }
  if (const Node* constants = reader.member("constants", false)) {
    ObjectReader inner(*constants, reader.at("constants"), findings);
    for (const std::string& key : constants->keys) {
      double value = 0.0;
      inner.required(key, value);
      spec.constants.emplace(key, value);
    }
  }
  reader.optional("in_series", spec.in_series);
  spec.sees = read_numbers(reader, findings, "sees");
  spec.acts = read_numbers(reader, findings, "acts");
  read_formula(reader, findings, spec);
  read_table(reader, findings, spec);
  reader.finish();
  return spec;
}

// Reads the parts of a model with several coordinates; for one coordinate they are omitted.
void read_coordinates(ObjectReader& reader, Findings& findings, ModelSpec& model) {
  reader.array("coordinates", false, {1, kCoordinatesMax},
               [&](const Node& node, const std::string& pointer) {
                 if (node.kind != Node::Kind::string || node.text.empty()) {
                   findings.add(node, pointer,
                                fmt::format("{} is not a name in double quotes", node.shown()));
                 } else if (std::find(model.coordinates.begin(), model.coordinates.end(),
                                      node.text) != model.coordinates.end()) {
                   findings.add(node, pointer, fmt::format("{} is given twice", node.shown()));
                 }
                 model.coordinates.push_back(node.text);
               });
  model.mass = read_numbers(reader, findings, "mass");
  model.excitation = read_numbers(reader, findings, "excitation");
  reader.optional("observed", model.observed);
  const auto expect = [&](const char* key, std::size_t given, std::size_t wanted) {
    if (given == wanted || (given == 0 && model.coordinates.size() <= 1)) return;
    reader.complain(key, fmt::format("has {} numbers; {} coordinate(s) want {}", given,
                                     std::max<std::size_t>(1, model.coordinates.size()), wanted));
  };
  const std::size_t s = std::max<std::size_t>(1, model.coordinates.size());
  expect("mass", model.mass.size(), s * s);
  expect("excitation", model.excitation.size(), s);
  if (!model.observed.empty() && std::find(model.coordinates.begin(), model.coordinates.end(),
                                           model.observed) == model.coordinates.end()) {
    reader.complain("observed", fmt::format("\"{}\" is none of the coordinates; {}", model.observed,
                                            suggestion(model.observed, model.coordinates)));
  }
}

// A known unit of length or angle; or {"label": "px"}: one that only this model uses, and that
// nothing converts.
void read_length_unit(ObjectReader& reader, Findings& findings, ModelSpec& model) {
  const Node* node = reader.member("length_unit", false);
  if (node == nullptr) return;
  if (node->kind == Node::Kind::object) {
    ObjectReader own(*node, reader.at("length_unit"), findings);
    own.required("label", model.length_unit);
    own.finish();
    return;
  }
  reader.optional("length_unit", model.length_unit);
  if (is_known_length(model.length_unit)) {
    model.length_unit = unit_called(model.length_unit)->name;
  } else if (node->kind == Node::Kind::string) {
    reader.complain(
        "length_unit",
        fmt::format("\"{0}\" is no unit of length; known are {1}, and of an angle {2}. "
                    "For one that only this model uses, say {{\"label\": \"{0}\"}}",
                    model.length_unit, units_of(Dimension::length), units_of(Dimension::angle)));
  }
}

// With one coordinate, two equal effects are indistinguishable.
void check_effect(const ModelSpec& model, const EffectSpec& effect, const Node& node,
                  const std::string& where, Findings& findings) {
  const std::size_t s = std::max<std::size_t>(1, model.coordinates.size());
  for (const auto& [key, numbers] :
       {std::pair{"sees", &effect.sees}, std::pair{"acts", &effect.acts}}) {
    // Effects of instrument and exciter have neither; the estimator knows which these are.
    const bool neither = effect.sees.empty() && effect.acts.empty();
    if (numbers->size() == s || neither) continue;
    findings.add(
        node, where,
        fmt::format("\"{}\" has {} numbers; {} coordinate(s) want {}", key, numbers->size(), s, s));
  }
  const bool twice = std::any_of(model.effects.begin(), model.effects.end(),
                                 [&](const EffectSpec& e) { return e.effect == effect.effect; });
  if (twice && s == 1 && !effect.effect.empty()) {
    findings.add(node, where,
                 fmt::format("effect \"{}\" occurs twice; leave one out", effect.effect));
  }
}

}  // namespace

ModelSpec read_model(const Node& node, const std::string& pointer, Findings& findings,
                     const std::string& origin) {
  ModelSpec model;
  model.origin = origin;
  ObjectReader reader(node, pointer, findings);
  reader.format("shaker-model/1");
  reader.required("name", model.name);
  read_length_unit(reader, findings, model);
  const auto metre = unit_called(model.length_unit, Dimension::length);
  reader.optional("gravity", model.gravity,
                  at_least(0).at_most(kLargestGravity / (metre ? metre->scale : 1e-6)));
  read_coordinates(reader, findings, model);
  reader.array("effects", true, {1, kEffectsMax},
               [&](const Node& effect, const std::string& where) {
                 EffectSpec spec = read_effect(effect, where, findings);
                 check_effect(model, spec, effect, where, findings);
                 model.effects.push_back(std::move(spec));
               });
  reader.finish();
  return model;
}

Result<ModelSpec> parse_model(const std::string& text, const std::string& origin) {
  const auto root = parse_json(text, origin);
  if (!root) return root.error();
  Findings findings(origin);
  ModelSpec model = read_model(*root, "", findings, origin);
  if (!findings.empty()) return findings.error();
  return model;
}

Result<ModelSpec> load_model(const std::filesystem::path& file) {
  const auto text = read_text(file);
  if (!text) return text.error();
  return parse_model(*text, file.string());
}

std::string to_json_text(const ModelSpec& model) {
  using Json = nlohmann::ordered_json;
  Json effects = Json::array();
  for (const EffectSpec& effect : model.effects) {
    const Driven parts = driven(effect.effect);
    Json item = {{"effect", parts.effect}};
    if (!parts.input.empty()) item["input"] = parts.input;
    if (effect.reference) item["reference"] = *effect.reference;
    for (const auto& [symbol, spec] : effect.parameters) {
      Json& parameter = item["parameters"][symbol] = Json::object();
      if (spec.start) parameter["start"] = *spec.start;
      if (spec.lower) parameter["lower"] = *spec.lower;
      if (spec.upper) parameter["upper"] = *spec.upper;
      if (spec.fixed) parameter["fixed"] = true;
      if (!spec.unit.empty()) parameter["unit"] = spec.unit;
      if (spec.prior_mean) parameter["prior_mean"] = *spec.prior_mean;
      if (spec.prior_standard_deviation) {
        parameter["prior_standard_deviation"] = *spec.prior_standard_deviation;
      }
      if (!spec.variation.per.empty()) parameter["per"] = spec.variation.per;
      if (!spec.variation.over.empty()) parameter["over"] = spec.variation.over;
      if (spec.variation.reference) parameter["reference"] = *spec.variation.reference;
    }
    for (const auto& [key, value] : effect.constants)
      item["constants"][key] = value;
    if (effect.in_series) item["in_series"] = true;
    if (!effect.sees.empty()) item["sees"] = effect.sees;
    if (!effect.acts.empty()) item["acts"] = effect.acts;
    if (effect.table) item["table"] = as_json(*effect.table);
    if (!effect.formula.empty()) item["formula"] = effect.formula;
    for (const auto& [symbol, state] : effect.states)
      item["states"][symbol] = {{"rate", state.rate}, {"start", state.start}};
    for (const auto& [symbol, lender] : effect.borrows)
      item["borrows"][symbol] = lender;
    effects.push_back(std::move(item));
  }
  Json root = {{"format", "shaker-model/1"}, {"name", model.name}, {"gravity", model.gravity}};
  if (is_known_length(model.length_unit))
    root["length_unit"] = model.length_unit;
  else
    root["length_unit"] = {{"label", model.length_unit}};
  if (!model.coordinates.empty()) root["coordinates"] = model.coordinates;
  if (!model.mass.empty()) root["mass"] = model.mass;
  if (!model.excitation.empty()) root["excitation"] = model.excitation;
  if (!model.observed.empty()) root["observed"] = model.observed;
  root["effects"] = std::move(effects);
  return root.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace shaker::config
