// What `shakerctl plan --for` aims at, and what its sets are worth for it.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/result.hpp"
#include "cli/commands.hpp"
#include "config/model.hpp"
#include "estimator/design/plan.hpp"

namespace shaker::cli {

// Its name, its value at the starts, its derivatives there, and at dampers that the prior allows. No
// derivatives: the volume of all parameters.
struct PlanAim {
  std::string label, unit;
  double value = 0.0;
  std::vector<double> derivatives;
  std::vector<estimator::PlanPoint> prior;
  std::size_t without_drop = 0;  // dampers of the prior that were left out
};

// An Error says which option is missing or wrong, or that there is no drop at the starts. Dampers of
// the prior without a drop are left out.
Result<PlanAim> aim_of(const PlanCommand& command, const config::ModelSpec& spec,
                       const estimator::Model& model);

// Gives the aim to the options, without the dampers of its prior with which the rig can do no run.
// Returns the sentence that says how many dampers the prior lost; empty: none.
std::string take_aim(const PlanAim& aim, const estimator::Model& model,
                     estimator::PlanOptions& options);

// Nothing where a plan has no aim.
void print_aim(const estimator::Plan& plan, const PlanAim& aim, std::size_t dampers);
void add_aim(const estimator::Plan& plan, const PlanAim& aim, nlohmann::ordered_json& json);

}  // namespace shaker::cli
