/// \file
/// The parameters of a model as it is, from a campaign of any kind: periodic responses, imposed
/// motions, drops, decays, sweeps. The fit and the errors are those of a diagnosis that names
/// nothing.
#pragma once

#include "base/result.hpp"
#include "config/model.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/fit/estimate.hpp"

namespace shaker::estimator::diagnosis {

/// Blocks for seconds; one core; allocates. Parameters are in the units of `model`. Where the model
/// misses the data by more than noise explains, `intervals_hold` is false, and the errors are
/// larger by as much. The gap is a root mean square in the unit of what is compared: the model's
/// length unit, or that per s^2 for forces along an imposed motion. Sums of squares are in units of
/// the noise. An Error is as of diagnose().
/// \param campaign the runs, all of one kind
/// \param model the model
/// \return the estimate; error `not_converged`: the model cannot be fitted
Result<Estimate> estimate_campaign(const Campaign& campaign, const config::ModelSpec& model);

}  // namespace shaker::estimator::diagnosis
