// The predicted load of a drop test over time, as an SVG file.
#pragma once

#include <optional>
#include <string>

#include "cli/measured_drop.hpp"
#include "estimator/time/drop.hpp"
#include "estimator/time/drop_mixture.hpp"

namespace shaker::cli {

struct DropPictureOptions {
  double sink_speed = 0.0;
  std::optional<double> mass;  // kg: the load is drawn in N
  std::string length_unit;
  const estimator::HistoryBand* band = nullptr;  // 95 %; null or empty: none
  const MeasuredDrop* measured = nullptr;        // drawn as points
};

// The time to draw: twice the time until the load stays near its last value. Pure.
double eventful_time(const estimator::DropHistory& history);

// The 95 % band of a history with standard errors; empty without them.
estimator::HistoryBand linear_band(const estimator::DropHistory& history);

// `truth`: a second curve, or nullptr.
std::string drop_picture(const estimator::DropRun& run, const estimator::DropHistory* truth,
                         const DropPictureOptions& options);

}  // namespace shaker::cli
