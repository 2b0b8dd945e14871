// Channels that count in another unit than is said. Start values are right to some factor only, and
// a model may bend a good way; so a factor is believed where the model fits with it and does not
// without.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "estimator/diagnosis/noise/screening.hpp"

namespace shaker::estimator::diagnosis {

// Where the fit leaves much of the response, an Error that names the channel, the runs and the
// units if a conversion factor on it, in every run or in those that stand apart, leaves less than a
// tenth of that. Gains that an effect could have (sensor_gain, exciter_gain) are none. Forces along
// an imposed motion that the fit takes, a hundred times what the start values give, are a warning.
Result<void> in_one_unit(const Look& look, const config::ModelSpec& model,
                         const FitOptions& options, std::vector<std::string>& warnings);

}  // namespace shaker::estimator::diagnosis
