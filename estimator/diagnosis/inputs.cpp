#include "estimator/diagnosis/internal/inputs.hpp"

#include <algorithm>
#include <limits>
#include <set>

#include <fmt/format.h>

#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/model/effects/catalogue.hpp"

namespace shaker::estimator::diagnosis {
namespace {

// Of the largest value: runs that differ by less do not tell what an input drives from what it does
// not.
constexpr double kLeastSpan = 0.01;
// Of the span of the runs' means, by which an input may scatter within a run: only its mean counts.
constexpr double kMostScatter = 0.1;

bool states(const Recording& run, const std::string& condition) {
  return run.condition.values.contains(condition);
}

bool all_state(const Campaign& campaign, const std::string& condition) {
  return std::all_of(campaign.runs.begin(), campaign.runs.end(),
                     [&](const Recording& run) { return states(run, condition); });
}

// The runs of which something is compared: others were left out.
std::vector<const Recording*> compared(const Campaign& campaign,
                                       const std::vector<RunDatum>& data) {
  std::vector<const Recording*> some;
  for (const Recording& run : campaign.runs) {
    if (std::any_of(data.begin(), data.end(), [&](const RunDatum& datum) {
          return run.name == (datum.sampled ? datum.sampled->record : datum.name);
        }))
      some.push_back(&run);
  }
  return some;
}

// Why the input cannot be used; sets its reference.
std::string fault_of(const std::vector<const Recording*>& runs, DrivingInput& input) {
  double least = std::numeric_limits<double>::infinity();
  for (const Recording* run : runs) {
    if (!states(*run, input.name))
      return fmt::format("run {} does not say its {}", run->name, input.name);
    const double value = run->condition.values.at(input.name);
    least = std::min(least, value);
    input.reference = std::max(input.reference, value);
  }
  if (least < 0.0)
    return fmt::format("{} is below 0 in a run, and a coefficient goes in proportion to it",
                       input.name);
  const double span = input.reference - least;
  if (!(span > kLeastSpan * input.reference))
    return fmt::format("{} is {:.4g} in all runs", input.name, input.reference);
  for (const Recording* run : runs) {
    const auto scatter = run->input_scatter.find(input.name);
    if (scatter == run->input_scatter.end() || scatter->second <= kMostScatter * span) continue;
    return fmt::format(
        "{0} varies within run {1}, by {2:.3g} about its mean of {3:.3g}, and the means of the "
        "runs differ by {4:.3g}: only the mean of a run counts; hold it still in a run, or state "
        "it under \"conditions\" if this is the sensor's noise",
        input.name, run->name, scatter->second, run->condition.values.at(input.name), span);
  }
  return {};
}

bool has_values_per(const config::ModelSpec& model, std::string_view what) {
  return std::ranges::any_of(model.effects, [&](const config::EffectSpec& line) {
    return std::ranges::any_of(
        line.parameters, [&](const auto& entry) { return entry.second.variation.per == what; });
  });
}

double mean_of(const Campaign& campaign, const std::string& condition) {
  double sum = 0.0;
  for (const Recording& run : campaign.runs)
    sum += run.condition.values.at(condition);
  return sum / static_cast<double>(campaign.runs.size());
}

}  // namespace

std::vector<DrivingInput> inputs_of(const Campaign& campaign, const std::vector<RunDatum>& data) {
  const auto runs = compared(campaign, data);
  std::vector<DrivingInput> inputs;
  for (const std::string& name : campaign.inputs) {
    DrivingInput& input = inputs.emplace_back(DrivingInput{name, 0.0, {}});
    input.unusable = fault_of(runs, input);
  }
  return inputs;
}

Campaign with_common_conditions(const Campaign& campaign, const config::ModelSpec& model) {
  Campaign common = campaign;
  std::set<std::string> partly;
  for (const Recording& run : campaign.runs) {
    for (const auto& [condition, value] : run.condition.values) {
      if (!all_state(campaign, condition)) partly.insert(condition);
    }
  }
  const bool per_run = has_values_per(model, "run"), per_group = has_values_per(model, "group");
  for (Recording& run : common.runs) {
    std::erase_if(run.condition.values,
                  [&](const auto& stated) { return partly.contains(stated.first); });
    run.condition.run = per_run ? run.name : "";
    if (!per_group) run.condition.group = "";
  }
  for (Recording& run : common.runs) {
    const bool alone = std::ranges::none_of(common.runs, [&](const Recording& other) {
      return other.role == Role::fit && other.condition.run == run.condition.run &&
             other.condition.group == run.condition.group;
    });
    if (run.role == Role::fit || !alone) continue;
    run.role = Role::fit;
    common.warnings.push_back(fmt::format(
        "run {} is fitted and not held out: a parameter has a value of its own in it", run.name));
  }
  return common;
}

Result<config::ModelSpec> with_run_values(config::ModelSpec model, const Campaign& campaign) {
  for (config::EffectSpec& line : model.effects) {
    for (auto& [symbol, parameter] : line.parameters) {
      config::RunVariation& v = parameter.variation;
      if (v.per.empty()) continue;
      for (const Recording& run : campaign.runs) {
        const std::string& label = v.per == "run" ? run.condition.run : run.condition.group;
        if (label.empty())
          return Error{
              ErrorKind::invalid,
              fmt::format("{} has a value per group, and run {} has no \"group\": give it one "
                          "in the campaign's file",
                          symbol, run.name)};
        if (std::ranges::find(v.values, label, &config::RunValue::label) == v.values.end())
          v.values.push_back({label, {}});
      }
    }
  }
  return model;
}

config::ModelSpec with_references(config::ModelSpec model, const Campaign& campaign) {
  const bool imposed = std::ranges::all_of(
      campaign.runs, [](const Recording& run) { return run.kind == Kind::imposed_motion; });
  for (config::EffectSpec& line : model.effects) {
    if (const Effect* effect = find_effect(line.effect); imposed && effect != nullptr)
      line.in_series = effect != &effect->as_part_in_series();
    const std::string input(config::driven(line.effect).input);
    if (!input.empty() && !line.reference && all_state(campaign, input) &&
        mean_of(campaign, input) > 0.0)
      line.reference = mean_of(campaign, input);
    for (auto& [symbol, parameter] : line.parameters) {
      config::RunVariation& v = parameter.variation;
      if (!v.over.empty() && !v.reference && all_state(campaign, v.condition()))
        v.reference = mean_of(campaign, v.condition());
    }
  }
  return model;
}

}  // namespace shaker::estimator::diagnosis
