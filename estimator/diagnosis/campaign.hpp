// A campaign as the diagnosis takes it: plain columns, whoever read them.
//
// Everything is in the model's length unit and seconds. Records are as they were taken: they begin
// with transients, are not a whole number of samples a cycle, and carry noise and quantisation.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace shaker::estimator::diagnosis {

enum class Kind {
  periodic,        // excitation known, displacement measured, steady response
  imposed_motion,  // displacement imposed, force measured: a damper dynamometer
  transient        // excitation known, displacement measured, not periodic
};

enum class Role { fit, held_out };

struct Recording {
  std::string name;
  Kind kind = Kind::periodic;
  Role role = Role::fit;
  bool role_given = false;    // false: the workflow chooses what it holds out
  double frequency_hz = 0.0;  // as it was set; 0 for a run that has none
  double amplitude = 0.0;     // as it was set
  std::vector<double> t;      // s, increasing
  std::vector<double> displacement;
  std::vector<double> excitation;    // table's acceleration; empty for imposed motion
  std::vector<double> force;         // per reference mass; only for imposed motion
  std::vector<double> acceleration;  // of the displacement's coordinate; may be empty
};

struct Campaign {
  std::string name;
  std::vector<Recording> runs;
  std::vector<std::string> warnings;  // of whoever read it
};

// The recording of a run of accepted cycles, whoever read them: any struct with the columns of
// `record::AcceptedCycles`, which this room does not know.
template <class Cycles>
Recording recording_of(Cycles run) {
  Recording recording;
  recording.name = std::move(run.name);
  recording.frequency_hz = run.frequency_hz;
  recording.amplitude = run.amplitude;
  recording.t = std::move(run.t);
  recording.displacement = std::move(run.displacement);
  recording.excitation = std::move(run.excitation);
  recording.acceleration = std::move(run.acceleration);
  recording.force = std::move(run.force);
  return recording;
}

// A run of accepted cycles, end to end, as a campaign's database gives it; one without any is left
// out, with a warning. Its force is of a load cell, N: over the mass that the cell carries, kg, or
// left out with a warning where that is not known (0).
void add_cycles(Campaign& campaign, Recording run, double reference_mass);

}  // namespace shaker::estimator::diagnosis
