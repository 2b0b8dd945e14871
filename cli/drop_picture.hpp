// The predicted load of a drop test over time, as an SVG file.
#pragma once

#include <optional>
#include <string>

#include "cli/measured_drop.hpp"
#include "estimator/drop/drop.hpp"
#include "estimator/drop/drop_mixture.hpp"

namespace shaker::cli {

struct DropPictureOptions {
  double sink_speed = 0.0;
  std::optional<double> mass;  // kg: the load is drawn in N
  std::string length_unit;
  const estimator::HistoryBand* band = nullptr;    // 95 %; null or empty: none
  const MeasuredDrop* measured = nullptr;          // drawn as points
  const estimator::HistoryBand* joined = nullptr;  // 95 % with the measured drop; null: none
};

// The time to draw: twice the time until the load stays near its last value. Pure.
double eventful_time(const estimator::DropHistory& history);

// The 95 % band of a history with standard errors; empty without them.
estimator::HistoryBand linear_band(const estimator::DropHistory& history);

// `truth`: a second curve, or nullptr.
std::string drop_picture(const estimator::DropRun& run, const estimator::DropHistory* truth,
                         const DropPictureOptions& options);

// A drop as the pictures of a page show it.
struct DropScene {
  const estimator::DropRun* run = nullptr;
  const estimator::DropShares* shares = nullptr;
  const std::vector<estimator::VisitedCell>* visited = nullptr;
  DropPictureOptions options;
};

// Load over time and over stroke, stroke over time, velocity over stroke with what the campaign
// visited, and what each effect carries, one after the other, for a page. Pure.
std::string drop_pictures(const DropScene& scene);

}  // namespace shaker::cli
