#include "config/run_condition.hpp"

#include <charconv>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "base/unit.hpp"
#include "config/object_reader.hpp"

namespace shaker::config {
namespace {

// The number of "35 degC" in the unit's SI unit; empty: no number, or an unknown unit.
std::optional<double> si_of(const std::string& text) {
  double number = 0.0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  if (read.ec != std::errc() || !std::isfinite(number)) return std::nullopt;
  std::string unit = text.substr(static_cast<std::size_t>(read.ptr - text.data()));
  unit.erase(0, unit.find_first_not_of(' '));
  const auto known = unit_called(unit);
  if (!known) return std::nullopt;
  return known->to_si(number);
}

}  // namespace

void read_condition(ObjectReader& run, Findings& findings, RunCondition& condition) {
  run.optional("group", condition.group);
  const Node* node = run.member("conditions", false);
  if (node == nullptr) return;
  ObjectReader inner(*node, run.at("conditions"), findings);
  for (const std::string& key : node->keys) {
    const Node* value = inner.member(key, true);
    if (value->kind != Node::Kind::string) {
      inner.required(key, condition.values[key]);
      continue;
    }
    if (const auto number = si_of(value->text))
      condition.values[key] = *number;
    else
      inner.complain(
          key,
          fmt::format("\"{}\" is not a number with a known unit, as \"35 degC\"; a plain number "
                      "does as well, since only its ratio from run to run counts",
                      value->text));
  }
}

std::vector<RunCondition> run_conditions(const std::string& campaign) {
  std::vector<RunCondition> all;
  const auto root = parse_json(campaign, "campaign");
  const Node* runs = root ? root->find("runs") : nullptr;
  if (runs == nullptr) return all;
  for (const Node& run : runs->elements) {
    Findings ignored("campaign");
    RunCondition condition;
    ObjectReader reader(run, "", ignored);
    if (!reader.is_object()) continue;
    reader.optional("name", condition.run);
    read_condition(reader, ignored, condition);
    if (!condition.group.empty() || !condition.values.empty()) all.push_back(std::move(condition));
  }
  return all;
}

}  // namespace shaker::config
