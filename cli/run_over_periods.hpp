// Runs whose response repeats only after two or three periods of the excitation, from files to the
// estimator's RunData: cycles are grouped so that each group begins in the same one of these
// periods, and the groups are averaged.
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
  long cycles = 0;  // single ones in it
};

// Whole cycles on equal steps, as they stand where the samples do, else put on 32 by the cubic
// through their neighbours: to look at, not to estimate from. No cycles where there are fewer than
// 8 samples in a period.
Cycles cycles_of(const CsvTable& table, double frequency_hz);

// Table and dwell as run_from_table has found them good. Samples on equal steps of whole periods
// are averaged as they stand; others by the trigonometric polynomial through all of them, which is
// then taken at as many points as it has coefficients, so that the points' errors are independent.
Result<RunOverPeriods> run_over_periods(const CsvTable& table, const std::string& origin,
                                        const Dwell& dwell, int periods);

// From all cycles of a run in a database: the daemon accepts none of such a response. The last
// unbroken succession is taken, from where it is steady on.
Result<RunOverPeriods> run_over_periods(const std::vector<record::CycleRow>& rows,
                                        const std::string& place, const std::string& name,
                                        int periods);

// The last cycles of a run whose numbers follow each other.
Cycles last_succession(const std::vector<record::CycleRow>& rows);

}  // namespace shaker::cli
