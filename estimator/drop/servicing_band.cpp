// The bands of a servicing envelope: the mixture of the drop in the states that count.
#include <algorithm>
#include <utility>

#include "estimator/drop/servicing.hpp"

namespace shaker::estimator {
namespace {

bool same_state(const ServicingState& a, const ServicingState& b) {
  return a.charge == b.charge && a.oil == b.oil && a.temperature == b.temperature;
}

std::vector<double> ends_of(const ServicingRange& range) {
  return range.low == range.high ? std::vector{range.low} : std::vector{range.low, range.high};
}

std::vector<ServicingState> corners_of(const ServicingRanges& ranges) {
  std::vector<ServicingState> corners;
  for (const double charge : ends_of(ranges.charge)) {
    for (const double oil : ends_of(ranges.oil)) {
      for (const double temperature : ends_of(ranges.temperature))
        corners.push_back({charge, oil, temperature});
    }
  }
  return corners;
}

// The states of the least and greatest values that are no corners.
std::vector<ServicingState> extremes_within(const ServicingEnvelope& envelope,
                                            const std::vector<ServicingState>& corners) {
  std::vector<ServicingState> within;
  const auto known = [&](const ServicingState& state) {
    const auto is_it = [&](const ServicingState& other) { return same_state(state, other); };
    return std::any_of(corners.begin(), corners.end(), is_it) ||
           std::any_of(within.begin(), within.end(), is_it);
  };
  for (const EnvelopeFigure& figure : envelope.figures) {
    for (const ServicingState& state : {figure.least_at, figure.greatest_at}) {
      if (!known(state)) within.push_back(state);
    }
  }
  return within;
}

}  // namespace

void add_bands(ServicingEnvelope& envelope, const IdentifiedDamper& damper,
               const DropConditions& conditions, const ServicingRanges& ranges,
               const MixtureOptions& options) {
  const auto band_in = [&](const ServicingState& state) {
    ServicingBand band{state, {}, 1.0};
    const auto drop =
        predict_drop(in_state(damper, state, ranges.tested_temperature), conditions, options);
    if (!drop) return band;
    band.without_drop = drop->bottoming_probability;
    for (const EnvelopeFigure& figure : envelope.figures) {
      const MixtureBand& own = drop->bands[figure.figure];
      band.figures.push_back({own.value, own.lower, own.upper});
    }
    return band;
  };
  const auto corners = corners_of(ranges);
  std::vector<ServicingBand> bands;
  for (const ServicingState& state : corners)
    bands.push_back(band_in(state));
  for (const ServicingState& state : extremes_within(envelope, corners))
    bands.push_back(band_in(state));
  for (std::size_t f = 0; f < envelope.figures.size(); ++f) {
    EnvelopeFigure& figure = envelope.figures[f];
    for (const ServicingBand& band : bands) {
      if (band.figures.empty()) continue;
      const FigureInterval& own = band.figures[f];
      auto& least = figure.least_interval;
      auto& greatest = figure.greatest_interval;
      if (!least) least = greatest = {own.lower, own.upper};
      least = {std::min((*least)[0], own.lower), std::min((*least)[1], own.upper)};
      greatest = {std::max((*greatest)[0], own.lower), std::max((*greatest)[1], own.upper)};
    }
  }
  bands.resize(corners.size());
  envelope.corners = std::move(bands);
}

}  // namespace shaker::estimator
