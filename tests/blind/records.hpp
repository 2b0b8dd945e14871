// Campaigns without a period for the blind suite: random, swept and drop-like records of the
// simulator's plants. The noise is coloured, or it is on the measured excitation.
//
// The physics is that of sim/. A Runge-Kutta scheme in this file integrates it, because the
// table of sim/ knows sines only. No code is shared with the estimator.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/diagnosis/campaign.hpp"
#include "tests/blind/suite.hpp"

namespace shaker::blind {

enum class Shape { random, swept, drop };
enum class RecordNoise {
  white,                // of the sensor
  coloured,             // of the sensor, autoregressive with 0.5 to 0.95 per sample
  excitation,           // white on the measured excitation, and white of the sensor
  coloured_excitation,  // autoregressive on the excitation, and white of the sensor
  both                  // coloured of the sensor, white of the excitation
};

struct RecordCase {
  Shape shape = Shape::random;
  std::string plant = "oleo";  // or "linear"
  RecordNoise noise = RecordNoise::white;
  std::string hidden;  // name of the missing effect; empty: nothing is missing
  Truth truth;
  std::uint64_t seed = 1;
  double seconds = 12.0;  // of each record except a drop
  std::string label() const;
};

// `count` campaigns in which nothing is hidden; shapes, plants and noises alternate.
std::vector<RecordCase> record_nulls(int count);
// The same with a hidden effect in each.
std::vector<RecordCase> record_effects(int count);

// Two runs to fit and one held out.
estimator::diagnosis::Campaign record_campaign(const RecordCase& wanted);
Answer answer(const RecordCase& wanted);

struct ScoredRecord {
  RecordCase hidden;
  Answer answer;
};
// A report of the alarms and the selected effects, for each noise and shape.
std::string report(const std::vector<ScoredRecord>& scored);

}  // namespace shaker::blind
