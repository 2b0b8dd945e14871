// From a recorded file's columns to a run that can be fitted.
#pragma once

#include <span>
#include <vector>

#include "base/result.hpp"
#include "estimator/estimation.hpp"

namespace shaker::estimator {

// A record in the steady state, of any length of at least one period, at any sampling.
struct Record {
  std::vector<double> t;             // s
  std::vector<double> displacement;  // the model's length unit
  std::vector<double> excitation;    // per s^2; empty: amplitude * cos(2 pi f t)
};

// Without a measured excitation tau = f t. With one, its frequency near `frequency_hz` and its
// first harmonics are fitted, tau = 0 is the peak of its fundamental, and `amplitude` is not used.
// An Error says which sample or column is wrong.
Result<RunData> run_from_record(const Record& record, double frequency_hz, double amplitude);

}  // namespace shaker::estimator
