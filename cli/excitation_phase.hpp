// Does a measured excitation keep the phase that its nominal frequency gives it? Cycles are cut by
// that frequency; where it is a little off they slide along the motion, cycle after cycle.
#pragma once

#include <vector>

namespace shaker::cli {

struct PhaseDrift {
  double turns = 0.0;  // from the first whole period to the last one, of a period
  double error = 0.0;  // its standard error, from the scatter of the phases about a line
  double frequency_hz = 0.0;
};

// Of samples of an excitation with a fundamental near `frequency_hz`, over at least four whole
// periods; none (all 0) over fewer.
PhaseDrift phase_drift(const std::vector<double>& t, const std::vector<double>& excitation,
                       double frequency_hz);

}  // namespace shaker::cli
