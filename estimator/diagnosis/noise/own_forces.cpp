#include "estimator/diagnosis/noise/internal/own_forces.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimator/diagnosis/noise/internal/noise_colour.hpp"
#include "estimator/diagnosis/records/internal/transient_run.hpp"
#include "estimator/math/statistics.hpp"

namespace shaker::estimator::diagnosis {
namespace {

constexpr const char* kLine = "own_force";
constexpr const char* kState = "own";
constexpr double kNamed = 0.1;  // of the forces without the named effects: what is left is none
constexpr double kForcesByChance = 1e-3;  // that equal records seem to differ

// The unit of the force keeps the state of order 1, whose prior is a standard normal density.
config::EffectSpec constant_force(double largest) {
  config::EffectSpec line;
  line.effect = kLine;
  line.constants = {{"size", largest}};
  return line;
}

config::EffectSpec own_force(double largest) {
  config::EffectSpec line = constant_force(largest);
  line.formula = fmt::format("size * {}", kState);
  line.states[kState].rate = "0";
  return line;
}

config::EffectSpec same_force(double largest) {
  config::EffectSpec line = constant_force(largest);
  line.formula = "size * same";
  line.parameters["same"].start = 0.0;
  return line;
}

HarmonicFit fitted_with(const HarmonicFit& fit, config::EffectSpec line,
                        const std::vector<RunDatum>& data, const FitOptions& options) {
  config::ModelSpec spec = fit.spec;
  std::vector<double> theta = fit.theta;
  if (!line.parameters.empty()) theta.push_back(0.0);
  spec.effects.push_back(std::move(line));
  return fit_harmonics(spec, data, theta, &fit, options);
}

double deviation_of(const std::map<std::string, double>& forces) {
  double sum = 0.0, square = 0.0;
  for (const auto& [record, force] : forces)
    sum += force;
  const auto count = static_cast<double>(forces.size());
  for (const auto& [record, force] : forces)
    square += std::pow(force - sum / count, 2);
  return std::sqrt(square / (count - 1.0));
}

// The lines behind it move up by one.
void take_line_out(config::ModelSpec& spec, std::vector<ModelNumber>& numbers) {
  const auto line = std::find_if(spec.effects.begin(), spec.effects.end(),
                                 [](const auto& l) { return l.effect == kLine; });
  if (line == spec.effects.end()) return;
  const auto at = static_cast<std::size_t>(line - spec.effects.begin());
  spec.effects.erase(line);
  for (ModelNumber& number : numbers)
    if (number.line > at) --number.line;
}

}  // namespace

// The mean over the stretches of each recording.
std::map<std::string, double> own_forces_of(const HarmonicFit& fit,
                                            const std::vector<RunDatum>& data) {
  const auto line = std::find_if(fit.spec.effects.begin(), fit.spec.effects.end(),
                                 [](const auto& l) { return l.effect == kLine; });
  if (line == fit.spec.effects.end() || line->states.empty()) return {};
  std::map<std::string, std::vector<double>> found;
  for (std::size_t r = 0; r < data.size(); ++r) {
    const TransientResponse* response = fit.predictions[r].transient();
    if (data[r].role == Role::fit && response != nullptr)
      found[data[r].sampled->record].push_back(
          line->constants.at("size") * response->start_of(fmt::format("{}.{}", kLine, kState)));
  }
  std::map<std::string, double> forces;
  for (const auto& [record, values] : found)
    forces[record] =
        std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  return forces;
}

std::optional<OwnForces> let_forces_differ(HarmonicFit& fit, double largest,
                                           const std::vector<RunDatum>& stated,
                                           const FitOptions& options) {
  std::vector<RunDatum> data = stated;
  for (RunDatum& datum : data)
    datum.budget = std::make_shared<EvaluationBudget>();  // a fixed amount of work
  if (data.front().by_force || !(largest > 0.0)) return std::nullopt;
  std::map<std::string, int> recordings;
  for (const RunDatum& datum : data)
    if (datum.role == Role::fit && datum.sampled) ++recordings[datum.sampled->record];
  if (recordings.size() < 2) return std::nullopt;
  HarmonicFit same = fitted_with(fit, same_force(largest), data, options);
  HarmonicFit own = fitted_with(fit, own_force(largest), data, options);
  if (!same.trouble.empty() || !own.trouble.empty()) return std::nullopt;
  const double gain = spectrum_gain({own, data}, {same, data});
  const auto more = static_cast<double>(recordings.size() - 1);
  if (!(gain > 0.0) || chi_squared_above(gain, more) > kForcesByChance) return std::nullopt;
  fit = std::move(own);
  return OwnForces{deviation_of(own_forces_of(fit, data))};
}

void take_out(const OwnForces& own, Diagnosis& said) {
  std::vector<ModelNumber> none;
  take_line_out(said.improved, none);
  for (DamperHypothesis& one : said.damper.hypotheses)
    take_line_out(one.model, one.numbers);
  if (said.own_forces.size() < 2) return;
  const double deviation = deviation_of(said.own_forces);
  if (deviation < kNamed * own.deviation) return;
  said.damper.spread.force = std::max(said.damper.spread.force, deviation);
  std::vector<std::string> each;
  for (const auto& [record, force] : said.own_forces)
    each.push_back(fmt::format("{} {:+.2g}", record, force));
  said.warnings.push_back(
      fmt::format("the runs differ in a constant force (preload, load) by {:.2g} {}/s^2 (standard "
                  "deviation; {}): each has its own here, and the improved model none",
                  deviation, said.improved.length_unit, fmt::join(each, ", ")));
}

}  // namespace shaker::estimator::diagnosis
