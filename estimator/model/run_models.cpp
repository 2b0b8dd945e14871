#include "estimator/model/run_models.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimator/model/effects/catalogue.hpp"
#include "estimator/model/internal/model_builder.hpp"

namespace shaker::estimator {
namespace {

using config::RunCondition;
using config::RunVariation;

std::string label_of(const RunVariation& variation, const RunCondition& run) {
  return variation.per == "run" ? run.run : run.group;
}

// Why a parameter has no value in a run; empty: it has one.
std::string lacks(std::string_view name, const RunVariation& variation, const RunCondition& run) {
  if (variation.per == "group" && run.group.empty())
    return fmt::format(
        "{} has a value per group, and run {} has no \"group\": give it one in the "
        "campaign's file",
        name, run.run);
  if (variation.over.empty()) return {};
  const std::string wanted = variation.condition();
  const auto found = run.values.find(wanted);
  if (found == run.values.end())
    return fmt::format(
        "{} goes with {}, and run {} does not say its {}: give it in the campaign's "
        "file, \"conditions\": {{\"{}\": 300}}",
        name, variation.over, run.run, wanted, wanted);
  // In proportion to a coil's current that is off: 0.
  const bool possible =
      variation.inverse() || !variation.reference ? found->second > 0.0 : found->second >= 0.0;
  if (!possible)
    return fmt::format(
        "{} goes in proportion to {}, and that of run {} is {:g}: it must be above "
        "0 (a temperature in K, or with its unit, as \"20 degC\"; 0 is possible beside a "
        "\"reference\")",
        name, wanted, run.run, found->second);
  return {};
}

// Coefficients of a driven effect go with its input, whatever else the file lets them differ by.
bool goes_with_input(std::string_view effect, std::string_view symbol) {
  const Effect* known = find_effect(effect);
  if (known == nullptr) return false;
  const auto all = known->parameters();
  return std::any_of(all.begin(), all.end(),
                     [&](const ParameterInfo& p) { return p.symbol == symbol && p.absent == 0.0; });
}

double mean_condition(const std::string& name, const std::vector<RunCondition>& runs) {
  double sum = 0.0;
  for (const RunCondition& run : runs)
    sum += run.values.at(name) / static_cast<double>(runs.size());
  return sum;
}

double factor_in(const RunVariation& variation, const RunCondition& run,
                 const std::vector<RunCondition>& runs) {
  const std::string name = variation.condition();
  if (name.empty() || !run.values.contains(name)) return 1.0;
  const double reference = variation.reference.value_or(mean_condition(name, runs));
  const double ratio = run.values.at(name) / reference;
  return variation.inverse() ? 1.0 / ratio : ratio;
}

}  // namespace

// Spreads the parameters of a model over the runs, and directs each run's effects to their own.
class RunModelMaker {
 public:
  RunModelMaker(const config::ModelSpec& spec, const std::vector<RunCondition>& runs)
      : runs_(runs) {
    ModelBuilder(single_, spec).build();
    for (const ModelParameter& p : single_.parameters())
      spread(p);
  }

  RunModels make() const {
    RunModels made;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      made.of_run.push_back(model_of(r));
      std::vector<RunParameter>& own = made.varying.emplace_back();
      for (std::size_t k = 0; k < place_.size(); ++k) {
        const ModelParameter& p = single_.parameters()[k];
        if (!p.variation.none()) own.push_back({p.name, place_[k][r], factor_[k][r]});
      }
    }
    return made;
  }

 private:
  void spread(const ModelParameter& p) {
    std::vector<int>& place = place_.emplace_back();
    std::vector<double>& factor = factor_.emplace_back();
    std::vector<std::string> labels;  // of the values so far
    const auto first = static_cast<int>(joint_.size());
    const auto add = [&](const std::string& label, std::optional<double> start) {
      ModelParameter one = p;
      if (!p.variation.per.empty()) one.name = fmt::format("{}[{}]", p.name, label);
      one.start = start.value_or(p.start);
      joint_.push_back(std::move(one));
      labels.push_back(label);
    };
    for (const config::RunValue& value : p.variation.values)
      add(value.label, value.start);
    for (const RunCondition& run : runs_) {
      const std::string label = p.variation.per.empty() ? "" : label_of(p.variation, run);
      if (std::ranges::find(labels, label) == labels.end()) add(label, {});
      place.push_back(first + static_cast<int>(std::ranges::find(labels, label) - labels.begin()));
      factor.push_back(factor_in(p.variation, run, runs_));
    }
  }

  std::shared_ptr<const Model> model_of(std::size_t run) const {
    auto model = std::make_shared<Model>(single_);
    model->parameters_ = joint_;
    const auto direct = [&](Model::Term& term) {
      const std::size_t count = term.effect->parameters().size();
      for (std::size_t k = 0; k < count; ++k) {
        const std::size_t single = static_cast<std::size_t>(term.first_parameter) + k;
        term.own.push_back(place_[single][run]);
        term.factors.push_back(factor_[single][run]);
      }
      for (int& lent : term.borrowed) {
        term.factors.push_back(lent >= 0 ? factor_[static_cast<std::size_t>(lent)][run] : 1.0);
        if (lent >= 0) lent = place_[static_cast<std::size_t>(lent)][run];
      }
    };
    for (Model::Term& term : model->terms_)
      direct(term);
    for (Model::Term& term : model->instruments_)
      direct(term);
    for (int k = 0; k < model->parameter_count(); ++k) {
      const bool mine = std::any_of(place_.begin(), place_.end(),
                                    [&](const auto& place) { return place[run] == k; });
      if (!mine) model->idle_.push_back(k);
    }
    return model;
  }

  Model single_;
  const std::vector<RunCondition>& runs_;
  std::vector<ModelParameter> joint_;
  std::vector<std::vector<int>> place_;      // of each single parameter in each run
  std::vector<std::vector<double>> factor_;  // likewise
};

bool has_run_values(const config::ModelSpec& spec) {
  return std::ranges::any_of(spec.effects, [](const config::EffectSpec& line) {
    return std::ranges::any_of(
        line.parameters, [](const auto& entry) { return !entry.second.variation.values.empty(); });
  });
}

Model model_of_first_values(const config::ModelSpec& spec) {
  RunCondition first;
  for (const config::EffectSpec& line : spec.effects) {
    for (const auto& [symbol, parameter] : line.parameters) {
      const RunVariation& variation = parameter.variation;
      if (variation.values.empty()) continue;
      (variation.per == "run" ? first.run : first.group) = variation.values.front().label;
    }
  }
  return *RunModelMaker(spec, {first}).make().of_run.front();
}

bool varies_by_run(const config::ModelSpec& spec) {
  return std::any_of(spec.effects.begin(), spec.effects.end(), [](const auto& effect) {
    return !config::driven(effect.effect).input.empty() ||
           std::any_of(effect.parameters.begin(), effect.parameters.end(),
                       [](const auto& entry) { return !entry.second.variation.none(); });
  });
}

std::string taken_as_one(const config::ModelSpec& spec, const std::string& what) {
  std::vector<std::string> names;
  for (const auto& effect : spec.effects) {
    if (!config::driven(effect.effect).input.empty()) names.push_back(effect.effect);
    for (const auto& [symbol, parameter] : effect.parameters) {
      if (!parameter.variation.none()) names.push_back(symbol);
    }
  }
  if (names.empty()) return {};
  return fmt::format("{} takes {} as the same in all runs, although the model lets {} differ", what,
                     fmt::join(names, ", "), names.size() == 1 ? "it" : "them");
}

std::string lacking_condition(const config::ModelSpec& spec,
                              const std::vector<RunCondition>& runs) {
  for (const RunCondition& run : runs) {
    for (const config::EffectSpec& line : spec.effects) {
      const config::Driven parts = config::driven(line.effect);
      if (!parts.input.empty()) {
        if (auto why = lacks(line.effect, {"", std::string(parts.input), line.reference}, run);
            !why.empty())
          return why;
      }
      for (const auto& [symbol, parameter] : line.parameters) {
        if (!parts.input.empty() && goes_with_input(parts.effect, symbol)) continue;
        if (auto why = lacks(symbol, parameter.variation, run); !why.empty()) return why;
      }
    }
  }
  return {};
}

Result<RunModels> run_models(const config::ModelSpec& spec, const std::vector<RunCondition>& runs) {
  if (runs.empty()) return Error{ErrorKind::invalid, "there is no run to estimate from"};
  if (auto why = lacking_condition(spec, runs); !why.empty())
    return Error{ErrorKind::invalid, std::move(why)};
  return RunModelMaker(spec, runs).make();
}

}  // namespace shaker::estimator
