// Campaigns without a period for the blind suite: random, swept and drop-like records of the
// simulator's plants, with noise that is not white, or that sits on the measured excitation.
//
// Physics are of sim/, the integration here is a Runge-Kutta scheme of its own (the table of sim/
// knows sines only); nothing is shared with the estimator.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/discrepancy/campaign.hpp"
#include "tests/blind/suite.hpp"

namespace shaker::blind {

enum class Shape { random, swept, drop };
enum class RecordNoise {
  white,                // of the sensor
  coloured,             // of the sensor, autoregressive with 0.5 .. 0.95 from sample to sample
  excitation,           // white on the measured excitation, besides white of the sensor
  coloured_excitation,  // autoregressive on the excitation, besides white of the sensor
  both                  // coloured of the sensor, white of the excitation
};

struct RecordCase {
  Shape shape = Shape::random;
  std::string plant = "oleo";  // or "linear"
  RecordNoise noise = RecordNoise::white;
  std::string hidden;  // name of what is missing; empty: nothing
  Truth truth;
  std::uint64_t seed = 1;
  double seconds = 12.0;  // of each record but a drop's
  std::string label() const;
};

// `count` campaigns in which nothing is hidden, shapes, plants and noises in turn.
std::vector<RecordCase> record_nulls(int count);
// As many in which something is.
std::vector<RecordCase> record_effects(int count);

// Two runs to fit and one held out.
estimator::discrepancy::Campaign record_campaign(const RecordCase& wanted);
Answer answer(const RecordCase& wanted);

struct ScoredRecord {
  RecordCase hidden;
  Answer answer;
};
// Alarms, and what was named, for each noise and shape.
std::string report(const std::vector<ScoredRecord>& scored);

}  // namespace shaker::blind
