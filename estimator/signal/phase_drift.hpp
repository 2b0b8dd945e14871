// Checks whether a measured excitation keeps the phase of its nominal frequency. Cycles are cut
// at the nominal frequency; when it is slightly wrong, the cycles shift against the motion.
#pragma once

#include <vector>

namespace shaker::estimator {

struct PhaseDrift {
  double turns = 0.0;  // from the first whole period to the last, in periods
  double error = 0.0;  // its standard error, from the scatter of the phases about a line
  double frequency_hz = 0.0;
  bool spoils_cycles() const;  // those that are cut at the nominal frequency are not alike
};

// From samples of an excitation with its fundamental near `frequency_hz`. t in s, increasing.
// All results are 0 with fewer than four whole periods.
PhaseDrift phase_drift(const std::vector<double>& t, const std::vector<double>& excitation,
                       double frequency_hz);

}  // namespace shaker::estimator
