// What falls and how: from the options of `drop` to conditions, mass, tyre and limits. By hand (sink
// speed, lift, mass, tyre), or by a rule whose effective weight is iterated with the drop itself.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "cli/commands.hpp"
#include "estimator/drop/drop.hpp"
#include "estimator/drop/drop_rule.hpp"
#include "estimator/drop/falling_damper.hpp"
#include "estimator/drop/servicing.hpp"

namespace shaker::cli {

// A limit of a figure: "peak_load=120kN".
struct DropLimit {
  std::string name;        // a figure's, or "load_factor"
  std::string text;        // as it was given
  std::size_t figure = 0;  // of kDropFigures
  double value = 0.0;      // in the model's units, loads over the mass above the damper
};

struct DropSetup {
  estimator::DropConditions conditions;
  double ratio = 1.0;          // the mass that falls on the damper over that on the shaker
  std::optional<double> mass;  // kg: above the damper
  std::optional<estimator::FallingTyre> tyre;
  std::optional<estimator::RuleDrop> rule;
  std::vector<DropLimit> limits;
  estimator::ServicingState state;   // in which it falls, over that of the campaign
  double tested_temperature = 20.0;  // degC

  // A model, hypothesis or damper of the shaker as it falls. Throw std::invalid_argument as the
  // functions of estimator/drop/falling_damper.hpp do.
  config::ModelSpec falling(const config::ModelSpec& model) const;
  estimator::DamperHypothesis falling(estimator::DamperHypothesis hypothesis) const;
  estimator::IdentifiedDamper falling(const estimator::IdentifiedDamper& damper) const;
  double kelvin() const;  // the tested temperature
};

// `damper`: the model of the damper on the shaker, without the shaker's effects; its starts are the
// estimates. Makes a drop for each step of a rule's iteration. An Error names the option and the
// remedy, or is that of a drop that does not turn. Throws std::invalid_argument as DropTest does.
Result<DropSetup> set_up_drop(const DropOptions& options, const config::ModelSpec& damper);

}  // namespace shaker::cli
