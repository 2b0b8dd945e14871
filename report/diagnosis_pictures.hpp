// The pictures of a diagnosis' page, as SVG. Private to report/.
#pragma once

#include <string>

#include "estimator/discrepancy/diagnosis.hpp"

namespace shaker::report {

using estimator::discrepancy::Diagnosis;
using estimator::discrepancy::RunCurves;

// Lengths read better in millimetres: {1000, "mm"} for metres, {1, unit} for others.
struct Shown {
  double factor = 1.0;
  std::string unit;
};
Shown shown_length(const std::string& unit);
// Of what drives the runs: the excitation, or the motion where that is imposed.
Shown shown_amplitude(const Diagnosis& diagnosis);

std::string gap_bars(const Diagnosis& diagnosis);
std::string cycle_picture(const Diagnosis& diagnosis, const RunCurves& run);
// Velocity over stroke, measured and predicted; empty where no displacement is predicted.
std::string phase_plane(const Diagnosis& diagnosis, const RunCurves& run);
std::string force_along_motion(const Diagnosis& diagnosis, const RunCurves& run);
// Binned over stroke, velocity or phase; empty when there are no bins.
std::string force_over_stroke(const Diagnosis& diagnosis);
std::string force_over_velocity(const Diagnosis& diagnosis);
std::string force_over_phase(const Diagnosis& diagnosis);
// Of all runs together, averaged over cells; `after` the named effects or before.
std::string force_map(const Diagnosis& diagnosis, bool after);
// What no parameter and no effect explains, with a dot where it may be nothing.
std::string remaining_map(const estimator::discrepancy::Diagnosis& diagnosis);
std::string harmonics_bars(const Diagnosis& diagnosis);

}  // namespace shaker::report
