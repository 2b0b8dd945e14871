#include "config/sweep.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>

namespace shaker::config {
namespace {

constexpr double kStepsMax = 200;
const std::array<std::string, 2> kSpacings = {"linear", "logarithmic"};

std::vector<double> stepped(double from, double to, int steps, bool logarithmic) {
  std::vector<double> values;
  for (int k = 0; k < steps; ++k) {
    const double part = static_cast<double>(k) / (steps - 1);
    values.push_back(logarithmic ? from * std::pow(to / from, part) : from + part * (to - from));
  }
  values.back() = to;
  return values;
}

}  // namespace

std::vector<double> read_steps(ObjectReader& reader, const std::string& key, Range range,
                               Findings& findings) {
  const Node* node = reader.member(key, true);
  if (!node) return {};
  if (node->kind != Node::Kind::object) {
    double value = 0.0;
    reader.required(key, value, range);
    if (value == 0.0) return {};
    return {value};
  }
  double from = 0.0, to = 0.0;
  int steps = 0;
  ObjectReader inner(*node, reader.at(key), findings);
  inner.required("from", from, range);
  inner.required("to", to, range);
  inner.required("steps", steps, at_least(2).at_most(kStepsMax));
  const auto spacing = inner.choice("spacing", kSpacings, false);
  inner.finish();
  if (from == 0.0 || to == 0.0 || steps == 0) return {};  // there is a finding
  if (from == to) {
    inner.complain("to", fmt::format("{:g} is \"from\" again; a sweep leads to another value", to));
    return {};
  }
  return stepped(from, to, steps, spacing && *spacing == 1);
}

}  // namespace shaker::config
