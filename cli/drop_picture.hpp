// The predicted load of a drop test over time, as an SVG file.
#pragma once

#include <optional>
#include <string>

#include "estimator/time/drop.hpp"

namespace shaker::cli {

struct DropPictureOptions {
  double sink_speed = 0.0;
  std::optional<double> mass;  // kg: the load is drawn in N
  std::string length_unit;
};

// The time to draw: twice the time until the load stays near its last value. Pure.
double eventful_time(const estimator::DropHistory& history);

// With the 95 % band where the history has standard errors. `truth`: a second curve, or nullptr.
std::string drop_picture(const estimator::DropRun& run, const estimator::DropHistory* truth,
                         const DropPictureOptions& options);

}  // namespace shaker::cli
