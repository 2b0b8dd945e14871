#include "bench/drop_truth.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

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

// The top of the parabola through the value at `at` and its neighbours, or that value where the
// curve jumps beside it.
double top_beside(const std::vector<double>& y, std::size_t at) {
  if (at < 2 || at + 2 >= y.size()) return y[at];
  const double before = y[at - 2] - 2.0 * y[at - 1] + y[at];
  const double here = y[at - 1] - 2.0 * y[at] + y[at + 1];
  const double after = y[at] - 2.0 * y[at + 1] + y[at + 2];
  if (!(here < 0.0) || -here > 8.0 * std::min(std::fabs(before), std::fabs(after))) return y[at];
  const double rise = y[at + 1] - y[at - 1];
  return y[at] - rise * rise / (8.0 * here);
}

// The force of the strut per mass. On a tyre the mass does not only go down by the stroke; the
// balance of the unsprung mass gives the force.
double load_of(const sim::Values& values, const sim::State& state, double acceleration) {
  const double stiffness = values.at("tyre_stiffness");
  if (stiffness == 0.0) return kGravity - acceleration;
  const double mass = values.at("unsprung_mass");
  const double tyre = stiffness * state[2] + values.at("tyre_damping") * state[3];
  return (tyre - mass * acceleration) / (1.0 + mass);
}

}  // namespace

TrueDrop true_drop(const std::map<std::string, double>& truth, double sink_speed) {
  const sim::Plant plant(kPlant, of_the_plant(truth));
  sim::State start = plant.at_rest();
  start[0] = 0.0;
  const bool tyre = truth.contains("tyre_stiffness");
  if (tyre) start[1] = start[2] = 0.0;
  start[tyre ? 3 : 1] = sink_speed;
  const sim::TableMotion still;
  sim::Integrator integrator(plant, start, 0.0);
  std::vector<double> stroke, load, work = {0.0};
  TrueDrop drop;
  for (int i = 0; i <= kTimes; ++i) {
    const double share = static_cast<double>(i) / kTimes;
    integrator.advance(kDuration * share * (0.002 + 0.998 * share), still);
    if (integrator.take_bottomed()) {
      drop.bottomed = true;
      return drop;
    }
    drop.t.push_back(kDuration * share * (0.002 + 0.998 * share));
    stroke.push_back(integrator.state()[0]);
    load.push_back(load_of(plant.values(), integrator.state(), integrator.acceleration(still)));
    const auto last = static_cast<std::size_t>(std::max(0, i - 1));
    work.push_back(work.back() + 0.5 * (load.back() + load[last]) * (stroke.back() - stroke[last]));
  }
  const auto peak =
      static_cast<std::size_t>(std::max_element(stroke.begin(), stroke.end()) - stroke.begin());
  drop.peak_stroke = top_beside(stroke, peak);
  const double absorbed = work[peak + 1] + load[peak] * (drop.peak_stroke - stroke[peak]);
  drop.peak_load = top_beside(
      load, static_cast<std::size_t>(std::max_element(load.begin(), load.end()) - load.begin()));
  drop.efficiency = absorbed / (drop.peak_load * drop.peak_stroke);
  drop.stroke = std::move(stroke);
  return drop;
}

}  // namespace shaker::bench
