// The data of jobs J1 and J2 (tests/data/README.md): one and twelve noisy periods of the oleo in
// feet, for tests and benchmarks.
#pragma once

#include <vector>

#include "estimator/fit/estimation.hpp"
#include "tests/estimator/fixtures.hpp"

namespace shaker::estimator::testing {

// 5 % above the truth.
inline const std::vector<double> kJobStart = {5.334, 5.25, 1.701, 1.05};

inline RunData job1() {
  RunData run;
  run.frequency_hz = 2.0;
  run.amplitude = 10.0;
  for (const auto& row : read_csv("oleo_j1.csv"))
    run.displacement.push_back(row[1]);
  return run;
}

inline std::vector<RunData> job2() {
  std::vector<RunData> runs;
  for (const auto& row : read_csv("oleo_j2.csv")) {
    if (runs.size() <= static_cast<std::size_t>(row[0])) {
      runs.emplace_back();
      runs.back().frequency_hz = row[1];
      runs.back().amplitude = row[2];
    }
    runs.back().displacement.push_back(row[4]);
  }
  return runs;
}

}  // namespace shaker::estimator::testing
