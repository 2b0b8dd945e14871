#include "estimator/diagnosis/report/internal/stated.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "estimator/diagnosis/fit/internal/smoothing.hpp"
#include "estimator/diagnosis/report/internal/estimates.hpp"

namespace shaker::estimator::diagnosis {
namespace {

const ParameterEstimate* estimate_of(const Diagnosis& said, const std::string& effect,
                                     const std::string& symbol) {
  const auto& all = said.parameters_after;
  const auto found = std::find_if(all.begin(), all.end(), [&](const ParameterEstimate& p) {
    return p.effect == effect && p.name == symbol;
  });
  return found == all.end() ? nullptr : &*found;
}

// What a model file stated and the data did not change.
void state_again(const config::ModelSpec& model, Diagnosis& said) {
  auto& lines = said.improved.effects;
  for (std::size_t i = 0; i < std::min(model.effects.size(), lines.size()); ++i) {
    for (const auto& [symbol, value] : model.effects[i].constants) {
      if (estimate_of(said, lines[i].effect, symbol) == nullptr) lines[i].constants[symbol] = value;
    }
  }
}

// The best hypothesis is the improved model. Its corners are as narrow as a prediction in time takes
// them, where the file does not state them.
void lead_hypotheses(const config::ModelSpec& model, Diagnosis& said) {
  if (said.damper.hypotheses.empty()) return;
  config::ModelSpec& best = said.damper.hypotheses.front().model;
  const config::ModelSpec narrow = std::exchange(best, with_mean_values(said.improved));
  for (std::size_t i = 0; i < std::min(narrow.effects.size(), best.effects.size()); ++i) {
    for (const auto& [symbol, value] : narrow.effects[i].constants) {
      if (i >= model.effects.size() || !model.effects[i].constants.contains(symbol))
        best.effects[i].constants[symbol] = value;
    }
  }
}

// What the data did change.
void warn_of_widths(const config::ModelSpec& model, Diagnosis& said) {
  for (const Turning& turning : turnings_of(model)) {
    const std::string& effect = model.effects[turning.line].effect;
    const ParameterEstimate* found = estimate_of(said, effect, turning.symbol);
    if (found == nullptr) continue;
    said.warnings.push_back(fmt::format(
        "{} turns round over {} = {:.3g} +- {:.2g} {} by these data; {} {:.3g}, which leaves more",
        effect, turning.symbol, found->value, found->standard_error, turning.unit,
        turning.stated ? "the model file states" : "the model file states none, the catalogue",
        turning.width));
  }
}

}  // namespace

void hold_against_file(const config::ModelSpec& model, Diagnosis& said) {
  state_again(model, said);
  lead_hypotheses(model, said);
  warn_of_widths(model, said);
}

}  // namespace shaker::estimator::diagnosis
