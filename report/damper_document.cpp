#include "report/damper_document.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "estimator/model/model.hpp"

namespace shaker::report {
namespace {

using Json = nlohmann::ordered_json;
using estimator::DamperHypothesis;
using estimator::IdentifiedDamper;
using estimator::ModelNumber;
using estimator::VisitedCell;

constexpr const char* kDamperFormat = "shaker-damper/1";

Json estimate_json(const DamperHypothesis& h) {
  const std::size_t size = h.numbers.size();
  Json numbers = Json::array(), covariance = Json::array();
  for (std::size_t k = 0; k < size; ++k) {
    const ModelNumber& number = h.numbers[k];
    Json entry = {{"effect", h.model.effects.at(number.line).effect},
                  {"line", number.line},
                  {"name", number.symbol},
                  {"value", estimator::value_of(h.model, number)},
                  {"standard_error", std::sqrt(std::max(0.0, h.covariance[k * size + k]))}};
    if (number.constant) entry["constant"] = true;
    numbers.push_back(std::move(entry));
    Json row = Json::array();
    for (std::size_t i = 0; i < size; ++i)
      row.push_back(h.covariance[k * size + i]);
    covariance.push_back(std::move(row));
  }
  return {{"degrees_of_freedom", h.degrees_of_freedom},
          {"parameters", std::move(numbers)},
          {"covariance", std::move(covariance)}};
}

Json cells_json(const std::vector<VisitedCell>& cells) {
  Json list = Json::array();
  for (const VisitedCell& cell : cells)
    list.push_back({cell.stroke, cell.velocity, cell.force, cell.standard_error});
  return list;
}

std::vector<VisitedCell> cells_from(const Json& list) {
  std::vector<VisitedCell> cells;
  for (const Json& cell : list)
    cells.push_back({cell.at(0).get<double>(), cell.at(1).get<double>(), cell.at(2).get<double>(),
                     cell.at(3).get<double>()});
  return cells;
}

// Throws std::invalid_argument, or what the JSON library throws, for an entry that is wrong.
DamperHypothesis hypothesis_from(const Json& json, const std::string& origin) {
  DamperHypothesis h;
  h.effects = json.at("effects").get<std::vector<std::string>>();
  h.probability = json.at("probability").get<double>();
  auto model = config::parse_model(json.at("model").dump(), origin);
  if (!model) throw std::invalid_argument(model.error().what);
  h.model = std::move(*model);
  const Json& estimate = json.at("estimate");
  h.degrees_of_freedom = estimate.at("degrees_of_freedom").get<double>();
  for (const Json& entry : estimate.at("parameters")) {
    ModelNumber number{entry.at("line").get<std::size_t>(), entry.at("name").get<std::string>(),
                       entry.value("constant", false)};
    if (number.line >= h.model.effects.size())
      throw std::invalid_argument(fmt::format("{} is of line {}, and the model has {} effects",
                                              number.symbol, number.line, h.model.effects.size()));
    h.numbers.push_back(std::move(number));
  }
  for (const Json& row : estimate.at("covariance")) {
    for (const Json& value : row)
      h.covariance.push_back(value.get<double>());
  }
  if (h.covariance.size() != h.numbers.size() * h.numbers.size())
    throw std::invalid_argument("the covariance does not have a row and a column a parameter");
  if (json.contains("left")) h.left = cells_from(json.at("left"));
  return h;
}

IdentifiedDamper damper_from(const Json& json, const std::string& origin) {
  if (json.at("format") != kDamperFormat)
    throw std::invalid_argument(fmt::format("its format is not \"{}\"", kDamperFormat));
  IdentifiedDamper damper;
  damper.campaign = json.at("campaign").get<std::string>();
  damper.verdict = json.at("verdict").get<std::string>();
  damper.data = json.value("data_sha256", "");
  damper.specimen = json.value("specimen", "");
  damper.unnamed_probability = json.at("unnamed").at("probability").get<double>();
  damper.unnamed_force = json.at("unnamed").at("force").get<double>();
  if (json.contains("run_spread")) {
    const Json& spread = json.at("run_spread");
    damper.spread = {spread.at("force").get<double>(), spread.at("gas_pressure").get<double>(),
                     spread.at("damping").get<double>()};
  }
  damper.visited = cells_from(json.at("visited"));
  for (const Json& one : json.at("hypotheses"))
    damper.hypotheses.push_back(hypothesis_from(one, origin));
  if (damper.hypotheses.empty()) throw std::invalid_argument("it holds no hypothesis");
  return damper;
}

}  // namespace

std::string damper_json(const IdentifiedDamper& damper) {
  Json hypotheses = Json::array();
  for (const DamperHypothesis& h : damper.hypotheses) {
    hypotheses.push_back({{"effects", h.effects},
                          {"probability", h.probability},
                          {"model", Json::parse(config::to_json_text(h.model))},
                          {"estimate", estimate_json(h)}});
    if (!h.left.empty()) hypotheses.back()["left"] = cells_json(h.left);
  }
  const Json body = {
      {"format", kDamperFormat},
      {"campaign", damper.campaign},
      {"verdict", damper.verdict},
      {"data_sha256", damper.data},
      {"specimen", damper.specimen},
      {"unnamed", {{"probability", damper.unnamed_probability}, {"force", damper.unnamed_force}}},
      {"run_spread",
       {{"force", damper.spread.force},
        {"gas_pressure", damper.spread.gas_pressure},
        {"damping", damper.spread.damping}}},
      {"hypotheses", std::move(hypotheses)},
      {"visited", cells_json(damper.visited)}};
  return body.dump(1, ' ', false, Json::error_handler_t::replace);
}

Result<IdentifiedDamper> read_damper(const std::filesystem::path& place) {
  std::error_code none;
  const auto file = std::filesystem::is_directory(place, none) ? place / kDamperFile : place;
  std::ifstream in(file);
  if (!in)
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot be read; `shakerctl diagnose CAMPAIGN --out {}` writes it",
                             file.string(), place.string())};
  const auto json = Json::parse(in, nullptr, false);
  if (!json.is_object())
    return Error{ErrorKind::invalid, fmt::format("{}: is not JSON; diagnose again", file.string())};
  try {
    return damper_from(json, file.string());
  } catch (const std::exception& error) {
    return Error{ErrorKind::invalid,
                 fmt::format("{}: {}; diagnose again", file.string(), error.what())};
  }
}

}  // namespace shaker::report
