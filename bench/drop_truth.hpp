// The true drop of a hidden damper: the plant of sim/ falls, with its own physics and integrator.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace shaker::bench {

struct TrueDrop {
  double peak_load = 0.0, peak_stroke = 0.0, efficiency = 0.0;  // m/s^2, m, -
  bool bottomed = false;          // the stroke ended at the wall: there is no such drop
  std::vector<double> t, stroke;  // s, m
};

// `truth`: the hidden parameters of the rig; those of its sensors and exciter stay on the shaker.
// At touch-down the stroke is 0 and grows with `sink_speed` (m/s), the memory of the parts is that
// of rest. With a tyre the stroke rests, and the deflection of the tyre grows from 0 with that speed.
// There is no lift.
TrueDrop true_drop(const std::map<std::string, double>& truth, double sink_speed);

}  // namespace shaker::bench
