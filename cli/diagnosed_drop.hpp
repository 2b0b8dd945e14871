// The drop of a damper that was diagnosed: from a campaign or the folder of a diagnosis to the
// prediction with its honest band.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "cli/commands.hpp"
#include "cli/drop_output.hpp"
#include "estimator/diagnosis/diagnosis.hpp"
#include "estimator/drop/drop_mixture.hpp"
#include "estimator/drop/joined_drop.hpp"
#include "estimator/model/identified_damper.hpp"

namespace shaker::cli {

// The prediction again, with the measured drop in the estimate.
struct JoinedPrediction {
  estimator::JoinedDrop drop;
  estimator::DropMixture after;
};

struct DiagnosedDrop {
  estimator::IdentifiedDamper damper;  // as it falls
  estimator::DropMixture drop;
  DropOutput output;
  estimator::ExtrapolationPriors priors;  // that are in the band
  std::string length;                     // the model's unit
  std::optional<JoinedPrediction> joined;
  // The prediction of the measured drop, where that fell otherwise than this one; else null.
  std::shared_ptr<const DiagnosedDrop> measured_fall;

  PredictedDrop predicted() const;
};

// The damper of options.diagnosis, or that of a diagnosis that is made now, whose warnings (runs that
// are left out) are added to `warnings`.
Result<estimator::IdentifiedDamper> damper_for(const DropOptions& options,
                                               std::vector<std::string>& warnings);

// `damper`: as it was on the shaker. An Error names the option and the remedy, or is that of a drop.
// Throws std::invalid_argument as DropTest does.
Result<DiagnosedDrop> predict_diagnosed(const DropOptions& options,
                                        const estimator::IdentifiedDamper& damper);

// "nothing is missing", or the effects that the hypothesis adds.
std::string name_of(const estimator::DamperHypothesis& hypothesis);

}  // namespace shaker::cli
