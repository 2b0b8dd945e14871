#include "bench/drop_truth.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "sim/integrator.hpp"
#include "sim/plant.hpp"

namespace shaker::bench {
namespace {

constexpr double kGravity = 9.80665;
constexpr double kDuration = 1.5;  // s
constexpr int kTimes = 12000;      // dense at touch-down
constexpr std::string_view kPlant = "oleo";

sim::Values of_the_plant(const std::map<std::string, double>& truth) {
  sim::Values own;
  for (const sim::PlantEntry& plant : sim::plant_table()) {
    if (plant.name != kPlant) continue;
    for (const sim::Parameter& p : sim::parameters_of(plant)) {
      if (const auto given = truth.find(std::string(p.name)); given != truth.end())
        own.insert(*given);
    }
  }
  return own;
}

// The largest value of a parabola through three values on equal steps.
double top_of(double before, double at, double after) {
  const double slope = 0.5 * (after - before), bend = after - 2.0 * at + before;
  return bend < 0.0 ? at - 0.5 * slope * slope / bend : at;
}

}  // namespace

TrueDrop true_drop(const std::map<std::string, double>& truth, double sink_speed) {
  const sim::Plant plant(kPlant, of_the_plant(truth));
  sim::State start = plant.at_rest();
  start[0] = 0.0;
  start[1] = sink_speed;
  if (truth.contains("tyre_stiffness")) start[2] = start[3] = 0.0;
  const sim::TableMotion still;
  sim::Integrator integrator(plant, start, 0.0);
  std::vector<double> stroke, load;
  TrueDrop drop;
  double absorbed = 0.0, last_stroke = 0.0, last_load = 0.0;
  bool turned = false;
  for (int i = 0; i <= kTimes; ++i) {
    const double share = static_cast<double>(i) / kTimes;
    integrator.advance(kDuration * share * (0.002 + 0.998 * share), still);
    if (integrator.take_bottomed()) {
      drop.bottomed = true;
      return drop;
    }
    stroke.push_back(integrator.state()[0]);
    load.push_back(kGravity - integrator.acceleration(still));
    turned = turned || integrator.state()[1] <= 0.0;
    if (i > 0 && !turned) absorbed += 0.5 * (load.back() + last_load) * (stroke.back() - last_stroke);
    last_stroke = stroke.back();
    last_load = load.back();
  }
  const auto peak = static_cast<std::size_t>(std::max_element(stroke.begin(), stroke.end()) -
                                             stroke.begin());
  drop.peak_stroke = top_of(stroke[peak - 1], stroke[peak], stroke[peak + 1]);
  absorbed += load[peak] * (drop.peak_stroke - stroke[peak]);
  const auto blow =
      static_cast<std::size_t>(std::max_element(load.begin(), load.end()) - load.begin());
  drop.peak_load = blow == 0 || blow + 1 == load.size()
                       ? load[blow]
                       : top_of(load[blow - 1], load[blow], load[blow + 1]);
  drop.efficiency = absorbed / (drop.peak_load * drop.peak_stroke);
  return drop;
}

}  // namespace shaker::bench
