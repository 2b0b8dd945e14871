// Converts the columns of a recorded file into a run that can be fitted.
#pragma once

#include <span>
#include <vector>

#include "base/result.hpp"
#include "estimator/estimation.hpp"

namespace shaker::estimator {

// A steady-state record of at least one period, with at least 8 samples a period on average. Its
// steps need not be equal.
struct Record {
  std::vector<double> t;             // s
  std::vector<double> displacement;  // the model's length unit
  std::vector<double> excitation;    // per s^2; empty: amplitude * cos(2 pi f t)
};

// Without a measured excitation tau = f t. With one, the function fits the excitation's
// frequency, within 1 % of `frequency_hz`, and its first harmonics. tau = 0 is then the peak of
// the fundamental, and `amplitude` is not used. Returns an Error that names the wrong sample or
// column.
Result<RunData> run_from_record(const Record& record, double frequency_hz, double amplitude);

}  // namespace shaker::estimator
