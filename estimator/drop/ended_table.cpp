#include "estimator/drop/internal/ended_table.hpp"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>

namespace shaker::estimator {
namespace {

constexpr double kFlat = 5.99;  // ln of a taper over that of an interval that counts as even

// "r4" of a table that gets an interval in front is "r5".
std::string one_later(const std::string& symbol) {
  int number = 0;
  if (symbol.size() < 2 || symbol[0] != 'r') return symbol;
  std::from_chars(symbol.data() + 1, symbol.data() + symbol.size(), number);
  return fmt::format("r{}", number + 1);
}

config::ParameterSpec started(double value) {
  config::ParameterSpec parameter;
  parameter.start = value;
  return parameter;
}

}  // namespace

std::optional<DamperHypothesis> ended_table(const DamperHypothesis& damper, double low,
                                            double high) {
  DamperHypothesis ended = damper;
  auto& lines = ended.model.effects;
  const auto line = std::find_if(lines.begin(), lines.end(),
                                 [](const auto& effect) { return effect.table.has_value(); });
  if (line == lines.end()) return std::nullopt;
  const auto at = static_cast<std::size_t>(line - lines.begin());
  config::PinTable& table = *line->table;
  const bool before = low<table.stroke.front(), after = high> table.stroke.back();
  const std::size_t knots = table.stroke.size() + (before ? 1 : 0) + (after ? 1 : 0);
  if ((!before && !after) || knots > config::kMostKnots) return std::nullopt;
  std::map<std::string, config::ParameterSpec> parameters;
  const auto keep = [&](const std::string& symbol) {
    const double value = value_of(damper.model, {at, symbol, false});
    parameters[before ? one_later(symbol) : symbol] = started(value);
  };
  keep("fall");
  for (std::size_t k = 2; k < table.stroke.size(); ++k)
    keep(fmt::format("r{}", k));
  if (before) {
    parameters["r2"] = started(kFlat);
    table.stroke.insert(table.stroke.begin(), low);
  }
  if (after) {
    table.stroke.push_back(high);
    parameters[fmt::format("r{}", knots - 1)] = started(-kFlat);
  }
  table.area.clear();
  line->parameters = std::move(parameters);
  for (ModelNumber& number : ended.numbers) {
    if (before && number.line == at) number.symbol = one_later(number.symbol);
  }
  return ended;
}

}  // namespace shaker::estimator
