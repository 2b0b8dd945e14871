// Runs of a campaign's folder for an estimate: recordings are cut into whole steady cycles.
// Where none are found, all samples are taken as they are, with a warning, if they repeat.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/fit/estimation.hpp"

namespace shaker::cli {

// One RunData for each periodic recording whose role is not `held_out`. The mean cycle has as many
// points as the recording has harmonics (2 H + 1), so that the noise of the points is independent.
// `harmonics`: Fourier coefficients instead (fit/harmonic_data.hpp). Warnings of the cutting,
// and a sentence for each run that is left out (held out, clipped, too short, not steady), are added
// to `warnings`. An Error names `place` and the run: a recording without a period, a mistake in one,
// or the first trouble where no run can be used.
Result<std::vector<estimator::RunData>> runs_of_recordings(
    const estimator::diagnosis::Campaign& campaign, const std::string& place, bool harmonics,
    std::vector<std::string>& warnings);

}  // namespace shaker::cli
