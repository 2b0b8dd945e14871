// Finds channels that count in another unit than the file says. Start values are right only to some
// factor, and a model may bend far. A factor is therefore believed only if the model fits with it
// and does not fit without it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/noise/internal/screening.hpp"

namespace shaker::estimator::diagnosis {

// If the fit leaves much of the response, tries conversion factors on each channel, in every run or
// in the runs that stand apart. Returns an Error with the channel, the runs and the units if a
// factor leaves less than a tenth of that. Factors near 1, which an effect could have (sensor_gain,
// exciter_gain), are not tried. Warns of fitted forces along an imposed motion that are a hundred
// times those of the start values.
Result<void> in_one_unit(const Look& look, const config::ModelSpec& model,
                         const FitOptions& options, std::vector<std::string>& warnings);

// An Error if in every record of an imposed motion the force gives out energy: a sign is wrong.
Result<void> takes_in_energy(const std::vector<std::shared_ptr<SampledRun>>& along_motions);

}  // namespace shaker::estimator::diagnosis
