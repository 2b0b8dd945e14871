/// \file
/// A campaign as the diagnosis takes it: plain columns, whoever read them.
///
/// Everything is in the model's length unit and seconds. Records are as they were taken: they begin
/// with transients, are not a whole number of samples a cycle, and carry noise and quantisation.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "config/run_condition.hpp"

namespace shaker::estimator::diagnosis {

/// What a run imposes and what it measures.
enum class Kind {
  periodic,        ///< excitation known, displacement measured, steady response
  imposed_motion,  ///< displacement imposed, force measured: a damper dynamometer
  transient        ///< excitation known, displacement measured, not periodic
};

/// What a diagnosis uses a run for: to fit, or to test the result on data that it did not fit.
enum class Role { fit, held_out };

/// The record of one run. All columns that are not empty have one value for each time.
struct Recording {
  std::string name;                  ///< of the run, for messages
  Kind kind = Kind::periodic;        ///< what was imposed and what was measured
  Role role = Role::fit;             ///< what the diagnosis uses the run for
  bool role_given = false;           ///< false: the workflow chooses what it holds out
  double frequency_hz = 0.0;         ///< as it was set; 0 for a run that has none
  double amplitude = 0.0;            ///< as it was set
  std::vector<double> t;             ///< s, increasing
  std::vector<double> displacement;  ///< in the model's length unit
  std::vector<double> excitation;    ///< table's acceleration, m/s^2; empty for imposed motion
  std::vector<double> force;         ///< per reference mass, m/s^2; only for imposed motion
  std::vector<double> acceleration;  ///< of the displacement's coordinate, m/s^2; may be empty
  /// For parameters that differ from run to run. The name in it is not read.
  config::RunCondition condition = {};
  /// Of inputs that were measured in this run: the standard deviation about their mean.
  std::map<std::string, double> input_scatter = {};
};

/// The runs of one damper.
struct Campaign {
  std::string name;                   ///< of the campaign, for messages
  std::vector<Recording> runs;        ///< in the order of measurement
  std::vector<std::string> warnings;  ///< of whoever read it
  std::vector<std::string> inputs;    ///< conditions of the runs that may drive effects
};

/// The recording of a run of accepted cycles, whoever read them: any struct with the columns of
/// `record::AcceptedCycles`, which this room does not know.
/// \param run a struct with name, frequency_hz, amplitude, t, displacement, excitation,
///   acceleration and force
/// \return the recording
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

/// A run of accepted cycles, end to end, as a campaign's database gives it; one without any is left
/// out, with a warning. Its force is of a load cell, N: over the mass that the cell carries, kg, or
/// left out with a warning where that is not known (0).
/// \param campaign receives the run, or a warning
/// \param run the recording; its force in N
/// \param reference_mass mass that the load cell carries, kg; 0: unknown
void add_cycles(Campaign& campaign, Recording run, double reference_mass);

}  // namespace shaker::estimator::diagnosis
