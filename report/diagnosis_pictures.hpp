// The pictures of the page of a diagnosis, as SVG. Private to report/.
#pragma once

#include <string>

#include "estimator/diagnosis/diagnosis.hpp"

namespace shaker::report {

using estimator::diagnosis::Diagnosis;
using estimator::diagnosis::RunCurves;

// The unit in which a length is drawn: {1000, "mm"} for metres, {1, unit} for other units.
struct Shown {
  double factor = 1.0;
  std::string unit;
};
Shown shown_length(const std::string& unit);
// The same for the amplitude of the runs: of the excitation, or of an imposed motion.
Shown shown_amplitude(const Diagnosis& diagnosis);

std::string gap_bars(const Diagnosis& diagnosis);
std::string cycle_picture(const Diagnosis& diagnosis, const RunCurves& run);
// Velocity over stroke, measured and predicted; empty when no displacement is predicted.
std::string phase_plane(const Diagnosis& diagnosis, const RunCurves& run);
std::string force_along_motion(const Diagnosis& diagnosis, const RunCurves& run);
// The mean missing force in bins of stroke, velocity or phase; empty when there are no bins.
std::string force_over_stroke(const Diagnosis& diagnosis);
std::string force_over_velocity(const Diagnosis& diagnosis);
std::string force_over_phase(const Diagnosis& diagnosis);
// The missing force of all runs, averaged over cells of stroke and velocity. `after`: with the
// added effects, otherwise with the base model.
std::string force_map(const Diagnosis& diagnosis, bool after);
// The force that no parameter and no effect explains. A dot marks a cell in which it may be
// noise.
std::string remaining_map(const estimator::diagnosis::Diagnosis& diagnosis);
std::string harmonics_bars(const Diagnosis& diagnosis);

}  // namespace shaker::report
