// The draws of a dirty campaign: what the damper is, what its model lacks, how it is measured.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/dirty/motion.hpp"

namespace shaker::dirty {

struct Noise {
  double response = 0.0;  // standard deviation, m or m/s^2
  double input = 0.0;     // m/s^2 or m
  double coloured = 0.0;  // share of the variance that is coloured
  double time = 0.0;      // s, correlation time of the coloured part
};

struct Campaign {
  std::uint64_t seed = 0;
  long index = 0;
  std::string kind;   // periodic, imposed, sweep, decay, drop
  std::string holds;  // "nothing", "unknown" or "effects": those of the catalogue and the unknown
  std::map<std::string, double> base;
  bool weight = false;  // gravity acts
  Effects effects;      // of the catalogue
  Effects unknown;      // one that is in no catalogue, or none
  std::string changes;  // zero, preload or temperature: what differs from run to run
  std::vector<Run> runs;
  std::vector<double> stated_frequency;  // Hz, of periodic and imposed runs
  Noise noise;
  double true_mass = 0.0;    // kg, of an imposed motion
  double stated_mass = 0.0;  // kg
  std::map<std::string, double> starts;
  // Root mean squares over all samples, of what the parameters of the base model cannot mimic,
  // linearised: in the response's unit (m, or m/s^2 of the true mass).
  std::map<std::string, double> visible;  // of each hidden effect and of the unknown
  double gap_alone = 0.0;                 // unknown and changes of the runs alone
  double motion = 0.0;                    // standard deviation of the response itself
};

// The campaign of this place in the suite. It follows from seed and index alone.
Campaign drawn(std::uint64_t seed, long index);

// The response of all runs, one after the other, without noise. `changes`: with what differs from
// run to run.
std::vector<double> responses(const Campaign& c, const Effects& hidden, bool changes);

// Standard deviation.
double spread(const std::vector<double>& values);

// The value that a sensor of this step shows; step 0: the value itself.
double quantised(double value, double step);
// The step of the campaign's sensor, 0 where it has none.
double quantum(const Effects& hidden);

// All that a campaign hides.
Effects all_hidden(const Campaign& c);

// Takes away from a response what the base parameters and the initial states can mimic, linearised
// at the truth.
class Projection {
 public:
  explicit Projection(const Campaign& campaign);
  // Root mean square of what is left of the difference of two responses; infinite where a run has
  // left the numbers.
  double visible(const std::vector<double>& with, const std::vector<double>& without) const;

 private:
  std::vector<std::vector<double>> columns_;  // orthonormal
};

// Fills `visible`, `gap_alone` and `motion`.
void measure(Campaign& campaign, const Projection& projection);

}  // namespace shaker::dirty
