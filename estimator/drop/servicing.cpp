#include "estimator/drop/servicing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace shaker::estimator {
namespace {

constexpr double kOilExpansion = 7e-4;  // 1/K, of mineral hydraulic oil
constexpr int kSpreadStates = 128;
constexpr double kBeyond = std::numeric_limits<double>::infinity();

const std::set<std::string_view>& turbulent() {
  static const std::set<std::string_view> names = {"orifice_damping", "metering_pin",
                                                   "tabulated_pin", "rebound_damping"};
  return names;
}

double start_of(const Model& model, const char* symbol) {
  for (const ModelParameter& p : model.parameters()) {
    if (p.effect == "gas_spring" && p.name.ends_with(symbol)) return p.start;
  }
  throw std::invalid_argument(fmt::format(
      "model '{}' has no gas spring, so it has no charge and no oil level", model.name()));
}

// Scales a parameter with the bounds that the model states.
void scale_start(config::ParameterSpec& parameter, double start, double factor) {
  parameter.start = factor * start;
  if (parameter.lower) parameter.lower = factor * *parameter.lower;
  if (parameter.upper) parameter.upper = factor * *parameter.upper;
}

double preload_factor(const ServicingState& state, double tested) {
  return state.charge * (tested + state.temperature) / tested;
}

double column_factor(const ServicingState& state) {
  return 1.0 / (1.0 - state.oil);
}

// The i-th point of van der Corput's sequence: evenly spread over 0 to 1 for every prime base.
double even_point(int i, int base) {
  double value = 0.0, share = 1.0 / base;
  for (; i > 0; i /= base, share /= base)
    value += share * (i % base);
  return value;
}

double inside(const ServicingRange& range, double share) {
  return range.low + share * (range.high - range.low);
}

std::vector<ServicingState> states_of(const ServicingRanges& r) {
  std::vector<ServicingState> states;
  const auto levels = [](const ServicingRange& range) { return range.low == range.high ? 1 : 3; };
  for (int a = 0; a < levels(r.charge); ++a) {
    for (int b = 0; b < levels(r.oil); ++b) {
      for (int c = 0; c < levels(r.temperature); ++c)
        states.push_back(
            {inside(r.charge, 0.5 * a), inside(r.oil, 0.5 * b), inside(r.temperature, 0.5 * c)});
    }
  }
  for (int i = 1; i <= kSpreadStates; ++i)
    states.push_back({inside(r.charge, even_point(i, 2)), inside(r.oil, even_point(i, 3)),
                      inside(r.temperature, even_point(i, 5))});
  return states;
}

}  // namespace

Result<void> check_ranges(const ServicingRanges& r) {
  const auto refused = [](const char* what, const char* range) {
    return Error{ErrorKind::invalid, fmt::format("the range of the {} must be {}", what, range)};
  };
  if (!(r.charge.low > 0.0 && r.charge.low <= r.charge.high && r.charge.high <= 10.0))
    return refused("charge", "above 0, at most 10, and in order");
  if (!(r.oil.low > -1.0 && r.oil.low <= r.oil.high && r.oil.high < 0.9))
    return refused("oil", "from above -1 to below 0.9 of the gas volume, and in order");
  if (!(r.temperature.low <= r.temperature.high && std::fabs(r.temperature.low) <= 150.0 &&
        std::fabs(r.temperature.high) <= 150.0))
    return refused("temperature", "within 150 K of the campaign's, and in order");
  if (!(r.tested_temperature > 200.0 && r.tested_temperature < 400.0))
    return refused("campaign's temperature", "from -73 to 126 degC");
  return {};
}

config::ModelSpec in_state(config::ModelSpec spec, const ServicingState& state, double tested) {
  const Model model(spec);
  const double theta2 = start_of(model, "theta2"), theta3 = start_of(model, "theta3");
  const double density = 1.0 - kOilExpansion * state.temperature;
  for (config::EffectSpec& line : spec.effects) {
    if (line.effect == "gas_spring") {
      scale_start(line.parameters["theta2"], theta2, preload_factor(state, tested));
      scale_start(line.parameters["theta3"], theta3, column_factor(state));
    }
    if (!turbulent().contains(line.effect) || density == 1.0) continue;
    const std::size_t size = std::max<std::size_t>(1, spec.coordinates.size());
    if (line.sees.empty()) line.sees.assign(size, 1.0);
    if (line.acts.empty()) line.acts.assign(size, 1.0);
    for (double& acts : line.acts)
      acts *= density;
  }
  return spec;
}

IdentifiedDamper in_state(IdentifiedDamper damper, const ServicingState& state, double tested) {
  for (DamperHypothesis& h : damper.hypotheses) {
    const std::size_t size = h.numbers.size();
    for (std::size_t k = 0; k < size && h.covariance.size() == size * size; ++k) {
      const ModelNumber& number = h.numbers[k];
      if (h.model.effects.at(number.line).effect != "gas_spring") continue;
      const double factor = number.symbol == "theta2"   ? preload_factor(state, tested)
                            : number.symbol == "theta3" ? column_factor(state)
                                                        : 1.0;
      for (std::size_t i = 0; i < size; ++i) {
        h.covariance[k * size + i] *= factor;
        h.covariance[i * size + k] *= factor;
      }
    }
    h.model = in_state(std::move(h.model), state, tested);
  }
  return damper;
}

Result<ServicingEnvelope> servicing_envelope(const config::ModelSpec& spec,
                                             const DropConditions& conditions,
                                             const ServicingRanges& ranges,
                                             const std::vector<std::size_t>& figures) {
  if (auto good = check_ranges(ranges); !good) return good.error();
  ServicingEnvelope out;
  for (const std::size_t f : figures)
    out.figures.push_back({f, kBeyond, -kBeyond, {}, {}, {}, {}, {}});
  std::vector<std::vector<double>> spread(figures.size());
  const auto states = states_of(ranges);
  const std::size_t first_spread = states.size() - kSpreadStates;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const DropTest test(in_state(spec, states[i], ranges.tested_temperature), conditions);
    const auto run = test.run(test.model().start(), false);
    ++out.drops;
    if (!run) {
      if (out.without++ == 0) out.without_at = states[i];
      continue;
    }
    for (std::size_t k = 0; k < figures.size(); ++k) {
      const double value = run->figures[figures[k]];
      EnvelopeFigure& figure = out.figures[k];
      if (value < figure.least) figure.least_at = states[i];
      if (value > figure.greatest) figure.greatest_at = states[i];
      figure.least = std::min(figure.least, value);
      figure.greatest = std::max(figure.greatest, value);
      if (i >= first_spread) spread[k].push_back(value);
    }
  }
  if (out.without == out.drops)
    return Error{ErrorKind::not_converged, "no state within the servicing ranges gives a drop"};
  for (std::size_t k = 0; k < figures.size(); ++k) {
    std::sort(spread[k].begin(), spread[k].end());
    const auto at = [&](double probability) {
      if (spread[k].empty()) return std::numeric_limits<double>::quiet_NaN();
      const auto place = probability * static_cast<double>(spread[k].size() - 1);
      return spread[k][static_cast<std::size_t>(place + 0.5)];
    };
    out.figures[k].quantiles = {at(0.05), at(0.5), at(0.95)};
  }
  return out;
}

}  // namespace shaker::estimator
