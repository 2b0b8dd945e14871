// One run of a dirty campaign: the damper moves, and its channels are sampled without noise.
#pragma once

#include <string>
#include <vector>

#include "tests/dirty/device.hpp"

namespace shaker::dirty {

enum class Drive {
  kPeriodic,  // the table moves harmonically
  kImposed,   // a dynamometer moves the damper harmonically and reads the force
  kSweep,     // the table's frequency rises
  kDecay,     // the damper is let go from a stroke
  kDrop,      // the damper lands at a speed
};

struct Run {
  Drive drive = Drive::kPeriodic;
  double frequency = 0.0;       // Hz; of a sweep: at its start
  double to_frequency = 0.0;    // Hz, of a sweep
  double amplitude = 0.0;       // m/s^2; of an imposed motion: m
  double phase = 0.0;           // rad
  double start_stroke = 0.0;    // m, of a decay; of an imposed motion: the middle
  double start_velocity = 0.0;  // m/s, of a drop
  double settle = 0.0;          // s before the first sample
  double duration = 0.0;        // s
  double step = 0.0;            // s between samples
  RunChange change;

  bool excited() const { return drive == Drive::kPeriodic || drive == Drive::kSweep; }
};

struct Channels {
  std::vector<double> time;      // s
  std::vector<double> input;     // recorded excitation, m/s^2, or imposed stroke, m; or empty
  std::vector<double> response;  // stroke, m, or force, m/s^2
};

// `effects`: for those of table and sensor, which no Device holds. Integrates by Runge and Kutta's
// method of order 4; a step ends where dry friction may begin to hold.
Channels moved(const Device& device, const Effects& effects, const Run& run);

}  // namespace shaker::dirty
