// The further inputs of a damper: a coil's current, a voltage, a temperature, a pressure. An effect
// that one of them drives has coefficients in proportion to it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/model.hpp"
#include "estimator/diagnosis/campaign.hpp"
#include "estimator/diagnosis/internal/run_datum.hpp"

namespace shaker::estimator::diagnosis {

struct DrivingInput {
  std::string name;
  double reference = 0.0;  // largest of the runs: there a driven coefficient is stated
  std::string unusable;    // why these runs cannot show what it drives; empty: they can
};

// The inputs that the campaign names, for those of its runs that are compared.
std::vector<DrivingInput> inputs_of(const Campaign& campaign, const std::vector<RunDatum>& data);

// The campaign with the conditions that all of its runs state; each with run and group where the model
// has a value of a parameter per run or group, otherwise without. A run that is held out and has such a
// value of its own is fitted: nothing else tells the value.
Campaign with_common_conditions(const Campaign& campaign, const config::ModelSpec& model);
// Names the values of parameters per run or group: those of the runs. An Error names the run that lacks a
// group.
Result<config::ModelSpec> with_run_values(config::ModelSpec model, const Campaign& campaign);
// States the reference of each parameter that goes with a condition of all runs: their mean, where
// the file states none; and that a joint is in series, where all motions are imposed. Returns the
// model otherwise as it is.
config::ModelSpec with_references(config::ModelSpec model, const Campaign& campaign);

}  // namespace shaker::estimator::diagnosis
