// What `drop` says besides the figures and their bands: the conditions by rule, the limits, the shares
// of the effects, the balance of energy, and the gas pressure. As text and as JSON.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/drop_setup.hpp"
#include "cli/measured_drop.hpp"
#include "estimator/drop/drop.hpp"
#include "estimator/drop/servicing.hpp"

namespace shaker::cli {

struct DropSections {
  DropSetup setup;
  estimator::DropShares shares;
  // Value of the deceleration and its 95 % interval, model's units; no interval: both ends equal.
  double deceleration = 0.0, deceleration_lower = 0.0, deceleration_upper = 0.0;
  std::vector<double> met;             // of each limit, the probability that it is met
  bool banded = false;                 // false: `met` is 1 or 0, of the values alone
  std::optional<double> gas_pressure;  // Pa, the largest
  estimator::StrokeEnd stroke_end;     // at the estimates
  double margin = 0.0, margin_lower = 0.0, margin_upper = 0.0;  // likewise, to the peak stroke
  // That the stroke reaches its end, or a draw gives no drop; nothing without an end or a band.
  std::optional<double> bottoming;
  std::optional<estimator::ServicingEnvelope> envelope;
  ComparisonWords words;
};

// The largest pressure of the gas, from the forces of its effects: `mass` above the damper, kg, and
// `area` of the piston, m^2. Nothing for a model without gas.
std::optional<double> gas_pressure(const estimator::DropShares& shares, double mass, double area);

// Each section as a heading and its rows, a label and a text. For the terminal and for a page.
using SectionRows = std::vector<std::pair<std::string, std::string>>;
struct DropSection {
  std::string heading;
  SectionRows rows;
};
std::vector<DropSection> drop_sections(const DropSections& sections);

std::string drop_sections_text(const DropSections& sections);
void add_drop_sections(const DropSections& sections, nlohmann::ordered_json& out);

}  // namespace shaker::cli
