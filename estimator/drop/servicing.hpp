// The servicing envelope: a drop over ranges of charge, oil level and temperature, at the estimates,
// and with the band of everything that the campaign leaves open.
//
//   charge       the gas pressure at the extended strut over that of the campaign: theta2
//   oil          oil that was added, over the gas volume of the extended strut: theta3 / (1 - oil)
//   temperature  of gas and oil over that of the campaign, K: theta2 in proportion to the absolute
//                temperature, the density of the oil and with it the forces of turbulent orifices by
//                -0.0007 a kelvin
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/drop/drop.hpp"
#include "estimator/drop/drop_mixture.hpp"
#include "estimator/model/identified_damper.hpp"

namespace shaker::estimator {

struct ServicingRange {
  double low = 0.0, high = 0.0;  // equal: as in the campaign
};
struct ServicingRanges {
  ServicingRange charge{1.0, 1.0};
  ServicingRange oil{0.0, 0.0};
  ServicingRange temperature{0.0, 0.0};
  double tested_temperature = 293.15;  // K
  bool any() const {
    return charge.low != charge.high || oil.low != oil.high || temperature.low != temperature.high;
  }
};

struct ServicingState {
  double charge = 1.0, oil = 0.0, temperature = 0.0;
  bool as_tested() const { return charge == 1.0 && oil == 0.0 && temperature == 0.0; }
  // This state, with `other` on top of it.
  ServicingState with(const ServicingState& other) const {
    return {charge * other.charge, 1.0 - (1.0 - oil) * (1.0 - other.oil),
            temperature + other.temperature};
  }
};

// An Error for ranges out of order or beyond sense.
Result<void> check_ranges(const ServicingRanges& ranges);

// The model in that state. Throws std::invalid_argument for a model without a gas spring.
config::ModelSpec in_state(config::ModelSpec spec, const ServicingState& state, double tested);

// The damper in that state. What is uncertain of a gas changes in proportion to it; the force that no
// hypothesis names stays.
IdentifiedDamper in_state(IdentifiedDamper damper, const ServicingState& state, double tested);

struct FigureInterval {
  double value = 0.0, lower = 0.0, upper = 0.0;
};

struct EnvelopeFigure {
  std::size_t figure = 0;              // of kDropFigures
  double least = 0.0, greatest = 0.0;  // over all states that were tried
  ServicingState least_at, greatest_at;
  std::array<double, 3> quantiles{};  // 5, 50 and 95 % where all states are equally likely
  // 95 % of the least and greatest value; nothing before add_bands.
  std::optional<std::array<double, 2>> least_interval, greatest_interval;
};

// A state with the mixture's band there.
struct ServicingBand {
  ServicingState state;
  std::vector<FigureInterval> figures;  // in the order of the envelope; empty: no drop at all
  double without_drop = 0.0;            // probability that a draw gives no drop
};
struct ServicingEnvelope {
  std::vector<EnvelopeFigure> figures;
  int drops = 0;
  int without = 0;  // states that give no drop: the stroke ends before it turns
  ServicingState without_at;
  // Every combination of the ranges' ends; empty before add_bands.
  std::vector<ServicingBand> corners;
};

// Three states along each range in every combination, and 128 spread evenly over the ranges. An
// Error for ranges out of order or beyond sense, or where no state gives a drop.
Result<ServicingEnvelope> servicing_envelope(const config::ModelSpec& spec,
                                             const DropConditions& conditions,
                                             const ServicingRanges& ranges,
                                             const std::vector<std::size_t>& figures);

// Puts the band of a drop, with `options`, to each corner of the ranges and to the states of the
// least and greatest values. The interval of a greatest value goes from the largest lower end to the
// largest upper end of these bands, that of a least value likewise. One mixture a state: blocks for
// some tenths of a second each. `damper`: as it falls. Throws std::invalid_argument as DropTest does.
void add_bands(ServicingEnvelope& envelope, const IdentifiedDamper& damper,
               const DropConditions& conditions, const ServicingRanges& ranges,
               const MixtureOptions& options = {});

}  // namespace shaker::estimator
