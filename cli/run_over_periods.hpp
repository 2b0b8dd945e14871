// Converts runs whose response repeats only after two or three periods of the excitation to
// RunData. The cycles are grouped so that each group begins in the same one of these periods,
// and the groups are averaged.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "cli/repetition.hpp"
#include "cli/run_data.hpp"
#include "record/campaign_database.hpp"

namespace shaker::cli {

struct RunOverPeriods {
  estimator::RunData data;
  long cycles = 0;  // number of single cycles in it
};

// The whole cycles of a table's displacement (estimator/signal/cycles.hpp).
Cycles cycles_of(const CsvTable& table, double frequency_hz);

// Samples on equal steps of whole periods are averaged directly. Other samples are fitted by a
// trigonometric polynomial, which is evaluated at as many points as it has coefficients, so
// that the errors of the points are independent. An Error says what the record lacks.
Result<RunOverPeriods> run_over_periods(const CsvTable& table, const std::string& origin,
                                        const Dwell& dwell, int periods);

// Uses all cycles of a run in a database, because the daemon accepts none of such a response.
// It takes the last cycles with consecutive numbers, from where the response is steady.
Result<RunOverPeriods> run_over_periods(const std::vector<record::CycleRow>& rows,
                                        const std::string& place, const std::string& name,
                                        int periods);

// The last cycles of a run with consecutive numbers.
Cycles last_unbroken_cycles(const std::vector<record::CycleRow>& rows);

}  // namespace shaker::cli
