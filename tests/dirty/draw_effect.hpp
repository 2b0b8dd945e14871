// Draws of the parameters of hidden effects, in the scales of the campaign.
#pragma once

#include <string>
#include <vector>

#include "tests/dirty/campaign.hpp"
#include "tests/dirty/random.hpp"

namespace shaker::dirty {

// What the base damper does in the campaign.
struct Scales {
  double low = 0.0;      // m, ends of the stroke
  double high = 0.0;     // m
  double speed = 0.0;    // m/s, the largest
  double load = 0.0;     // m/s^2, half of the range of the load
  double damping = 0.0;  // m/s^2, the largest
  double range() const { return high - low; }
  double middle() const { return 0.5 * (low + high); }
};

// Effects of the catalogue that the kind of campaign can hold.
std::vector<std::string> candidates(const std::string& kind, bool oleo);

// Parameters of an effect of the catalogue.
std::map<std::string, double> drawn_effect(const std::string& name, const Scales& scales,
                                           Random& random);

// One of five effects that are in no catalogue; its parameter `size` is of no particular size.
Effects drawn_unknown(const Scales& scales, Random& random);

}  // namespace shaker::dirty
